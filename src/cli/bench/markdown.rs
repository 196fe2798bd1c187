//! The record as Markdown.

use super::numbers::{grouped, millis, relative, short, three_digits};
use super::record::{CaseRecord, Figures, JobRecord, Record};
use super::table::Table;
use crate::cli::memory::Size;

/// The whole text.
pub fn text(record: &Record) -> String {
    let mut text = heading(record) + &devices(record);
    if record.scales {
        text += &growth(record);
    } else {
        for case in &record.cases {
            text += &jobs(case);
        }
    }
    // One blank line between parts, none at the end.
    text.trim_end().to_string() + "\n"
}

fn heading(record: &Record) -> String {
    let machine = &record.machine;
    let cores = if machine.cores == 1 { "1 core".into() } else { format!("{} cores", machine.cores) };
    let rival = record.baseline.map_or_else(String::new, |version| format!(", {version}"));
    let repeats = if record.repeats == 1 { "the one run".into() } else { format!("{} runs", record.repeats) };
    let points = record.samples.map_or_else(String::new, |samples| {
        let samples = grouped(samples);
        format!(" Deviations are the greater of both sides, from the input there and from the result back, at {samples} points of each.")
    });
    format!(
        "# coarsen {}{rival}\n\n{}, {cores}; {}\n\n\
         Times are medians of {repeats} in turns, after one that does not count, from mesh in memory to mesh in memory, \
         positions and faces only; the spread is from the least to the greatest. The memory is what a process of its own \
         grows by, the input included, for each face of the input.{points}\n\n",
        record.version, machine.cpu, machine.os
    )
}

fn devices(record: &Record) -> String {
    let mut table = Table::new(["device", "what it is"]);
    for entrant in &record.devices {
        let what = match (&entrant.device, &entrant.failure) {
            (_, Some(reason)) => format!("not run: {reason}"),
            (Some(device), None) if entrant.is_software => format!("{device} (software on the CPU's own cores)"),
            (device, None) => device.clone().unwrap_or_default(),
        };
        table.rows.push(vec![entrant.name.clone(), what]);
    }
    table.lines(2)
}

fn jobs(case: &CaseRecord) -> String {
    let mut text = format!(
        "## {}: {} faces, {} vertices, read in {} ms\n\n",
        case.input,
        grouped(case.faces),
        grouped(case.vertices),
        millis(case.read_secs)
    );
    for job in &case.jobs {
        text += &format!("### To {job}\n\n");
        text += &figures(case, job);
        text += &phases(job);
        text += &deviations(job);
        text += &remarks(job);
    }
    text
}

fn figures(case: &CaseRecord, job: &JobRecord) -> String {
    let rival = job.results.iter().find(|figures| figures.phases.is_none());
    let ratio = rival.map(|rival| format!("× {}", rival.device));
    let before = ["device", "output", "ms", "spread"].map(String::from);
    let after = ["M faces/s", "faces", "rounds", "moved", "bytes a face"].map(String::from);
    let mut table = Table::new(before.into_iter().chain(ratio).chain(after));
    for figures in &job.results {
        let seconds = &figures.seconds;
        let mut row = vec![
            figures.device.clone(),
            output(job, figures),
            millis(seconds.median),
            format!("{} – {}", millis(seconds.min), millis(seconds.max)),
        ];
        row.extend(rival.map(|rival| format!("{:.2}", seconds.median / rival.seconds.median)));
        let moved = figures.bytes_moved.filter(|&bytes| bytes > 0);
        row.extend([
            three_digits(figures.faces_per_second / 1e6),
            grouped(figures.faces_out),
            rounds(figures),
            moved.map_or_else(|| "-".into(), |bytes| Size(bytes).to_string()),
            figures.peak_bytes.map_or_else(|| "-".into(), |bytes| (bytes / case.faces as u64).to_string()),
        ]);
        table.rows.push(row);
    }
    table.lines(2)
}

/// Whether the output is that of another, and of which.
fn output(job: &JobRecord, figures: &Figures) -> String {
    let is_own = figures.phases.is_some();
    let first = job.results.iter().find(|other| other.phases.is_some());
    match (&figures.same_bytes_as, first) {
        _ if !figures.repeatable => "differs from run to run".into(),
        (Some(other), _) => format!("same bytes as {other}"),
        (None, Some(first)) if is_own && first.device != figures.device => format!("differs from {}", first.device),
        _ => "-".into(),
    }
}

fn rounds(figures: &Figures) -> String {
    match (figures.rounds, figures.rounds_on_gpu) {
        (Some(rounds), Some(on_gpu)) if on_gpu > 0 => format!("{rounds}, {on_gpu} on it"),
        (Some(rounds), _) => rounds.to_string(),
        (None, _) => "-".into(),
    }
}

/// The phases of the median runs, in milliseconds.
fn phases(job: &JobRecord) -> String {
    let names = ["weld", "build", "cost", "select", "filter", "apply", "transfer", "restore", "write"];
    let mut table = Table::new(["ms of the median run"].into_iter().chain(names));
    for figures in &job.results {
        if let Some(p) = &figures.phases {
            let secs = [p.weld, p.build, p.cost, p.select, p.filter, p.apply, p.transfer, p.restore, p.write];
            table.rows.push([figures.device.clone()].into_iter().chain(secs.map(millis)).collect());
        }
    }
    if table.rows.is_empty() { String::new() } else { table.lines(1) }
}

/// How far the results are from the input, one row for all of the same bytes.
fn deviations(job: &JobRecord) -> String {
    let columns = ["1/10,000 of the diagonal", "RMS", "mean", "max", "RMS there", "RMS back", "normals: mean"];
    let mut table = Table::new(columns);
    for figures in job.results.iter().filter(|figures| figures.same_bytes_as.is_none()) {
        let Some(deviation) = &figures.deviation else { continue };
        let same = job.results.iter().filter(|other| other.same_bytes_as.as_ref() == Some(&figures.device));
        let names: Vec<&str> = std::iter::once(figures).chain(same).map(|figures| figures.device.as_str()).collect();
        let (both, there, back) = (deviation.symmetric(), &deviation.forward, &deviation.backward);
        let lengths = [both.rms, both.mean, both.max, there.distance.rms, back.distance.rms];
        let degrees = there.normals.mean_rad.max(back.normals.mean_rad).to_degrees();
        let mut row = vec![names.join(", ")];
        row.extend(lengths.map(|length| three_digits(relative(length, deviation.diagonal) * 1e4)));
        row.push(format!("{degrees:.2}°"));
        table.rows.push(row);
    }
    if table.rows.is_empty() { String::new() } else { table.lines(1) }
}

/// What failed, and what the devices warn of, each once.
fn remarks(job: &JobRecord) -> String {
    let mut lines: Vec<String> = Vec::new();
    for entrant in &job.failures {
        lines.push(format!("- {} failed: {}\n", entrant.name, entrant.failure.as_deref().unwrap_or("")));
    }
    for figures in &job.results {
        lines.extend(figures.warnings.iter().map(|warning| format!("- {}: {warning}\n", figures.device)));
    }
    if lines.is_empty() { String::new() } else { lines.concat() + "\n" }
}

/// Time and speed by size, a table a target.
fn growth(record: &Record) -> String {
    let name = record.cases.first().map_or("", |case| case.input.split('@').next().unwrap_or_default());
    let mut text = format!("## {name} by size\n\nThe time grows by the power of the size in the last column.\n\n");
    let Some(first) = record.cases.first() else { return text };
    for (j, job) in first.jobs.iter().enumerate() {
        text += &format!("### To {job}\n\n");
        let sizes =
            record.cases.iter().map(|case| case.input.split('@').nth(1).map_or(short(case.faces), String::from));
        let columns = sizes.flat_map(|size| [format!("{size}: ms"), "M faces/s".into()]);
        let mut table = Table::new(["device".to_string()].into_iter().chain(columns).chain(["power".to_string()]));
        for growth in record.growth.iter().filter(|growth| growth.job == j) {
            let mut row = vec![growth.device.clone()];
            for case in &record.cases {
                let found = case.jobs[j].results.iter().find(|figures| figures.device == growth.device);
                row.extend(match found {
                    Some(found) => [millis(found.seconds.median), three_digits(found.faces_per_second / 1e6)],
                    None => ["failed".into(), "-".into()],
                });
            }
            row.push(growth.exponent.map_or_else(|| "-".into(), |power| format!("{power:.2}")));
            table.rows.push(row);
        }
        text += &table.lines(1);
    }
    text
}
