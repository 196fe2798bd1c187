//! How far the results are from the input, each once.

use coarsen::metrics::{Options, deviation};
use coarsen::{Device, Mesh};

use super::case::Case;
use super::record::JobRecord;
use super::ticker::Ticker;

/// Measures `outputs`, one a result, at `samples` points of each surface; those of the same bytes share a measurement.
pub fn measure(job: &mut JobRecord, case: &Case, outputs: &[Mesh], samples: usize, device: &Device, ticker: &Ticker) {
    let options = Options { samples: Some(samples), ..Options::default() };
    for (i, output) in outputs.iter().enumerate() {
        let (earlier, [figures, ..]) = job.results.split_at_mut(i) else { return };
        if let Some(same) = earlier.iter().find(|other| Some(&other.device) == figures.same_bytes_as.as_ref()) {
            figures.deviation = same.deviation.clone();
            continue;
        }
        ticker.show(&format!("deviation of {}", figures.device));
        match deviation(&case.mesh, output, &options, device) {
            Ok(deviation) => figures.deviation = Some(deviation),
            Err(error) => figures.warnings.push(format!("its deviation was not measured: {error}")),
        }
    }
}
