//! \[Jin09\] beside what is measured.

use coarsen::papers::regions::{self, BAND, LEAST_RATIO, REGIONS};

use super::super::numbers::{grouped, millis, percent, three_digits};
use super::super::table::Table;
use super::{Tables, short_name, verdict};

impl Tables<'_> {
    /// The table of the models that are here, or else of every mesh.
    pub(super) fn regions(&self) -> anyhow::Result<String> {
        let columns = [
            "mesh",
            "faces",
            "paper's",
            "regions",
            "method",
            "verdict",
            "falls",
            "ms",
            "paper's",
            "energy",
            "paper's",
            "×",
            "Lloyd : it",
            "paper's",
        ];
        let mut table = Table::new(columns);
        let is_model = |name: &str| regions::published(name).is_some();
        let has_models = self.cases.iter().any(|case| is_model(&short_name(case)));
        for case in self.cases {
            let (name, faces) = (short_name(case), case.mesh.faces.len());
            let published = regions::published(&name);
            if has_models && published.is_none() {
                continue;
            }
            let count = published.map_or(REGIONS, |row| row.regions);
            self.ticker(&case.name, "regions").show(&format!("{count} in turns"));
            let trials = regions::row(&case.mesh, count, self.repeats, &self.device)?;
            let or_none = |text: Option<String>| text.unwrap_or_else(|| "-".into());
            for (way, trial) in regions::contenders().iter().zip(&trials) {
                let figures = published.and_then(|row| row.figures(way));
                let held = published.and_then(|row| row.is_held(way, faces, trial));
                let lloyd = way.lloyd.map(|lloyd| trials[lloyd].secs / trial.secs);
                let ratio_of =
                    |row: &regions::Published| Some(row.lloyd?[0] / row.greedy[0]).filter(|_| lloyd.is_some());
                table.rows.push(vec![
                    name.clone(),
                    grouped(faces),
                    or_none(published.map(|row| grouped(row.faces))),
                    trial.regions.to_string(),
                    way.name.into(),
                    or_none(held.map(verdict)),
                    if trial.falls { "yes" } else { "no" }.into(),
                    millis(trial.secs),
                    or_none(figures.map(|[millis, _]| format!("{millis}"))),
                    format!("{:.4}", trial.energy),
                    or_none(figures.map(|[_, energy]| format!("{energy:.4}"))),
                    or_none(figures.map(|[_, energy]| format!("{:.2}", trial.energy / energy))),
                    or_none(lloyd.map(three_digits)),
                    or_none(published.and_then(ratio_of).map(three_digits)),
                ]);
            }
        }
        Ok(format!(
            "## [Jin09] Variational shape approximation\n\nTime from the mesh in memory to its regions, and their energy where \
             half the diagonal is 1: the best of three attempts, all of them timed. Models are found by their names; held is an \
             energy of up to {} of the paper's in the paper's time, on a mesh of as many faces. As published, faces move one by \
             one; greedy is this program's default, which also exchanges regions; rounds move many at once. Falls is that the \
             energy never rose on the way, which Lloyd's iterations do not promise. They are to take at least {LEAST_RATIO} times \
             as long as what exchanges regions as they do, or does not. Other meshes have {REGIONS} regions, where no model is named.\n\n{}",
            percent(BAND),
            table.lines(7)
        ))
    }
}
