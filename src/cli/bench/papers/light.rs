//! \[Liu99\] beside what is measured.

use coarsen::metrics;
use coarsen::papers::light::{self, CURVE_DELTA, CURVE_EPSILON, Curve, MOST_RISE, PAIRS, Row, Trial};

use super::super::case::Case;
use super::super::numbers::{grouped, millis, percent, three_digits};
use super::super::plot::Line;
use super::super::table::Table;
use super::{Tables, few_digits, of_diagonal, short_name, verdict};

/// The curves of a scene, over the step of light and over the color along borders.
pub struct Scene {
    pub name: String,
    pub faces: usize,
    pub curves: [Curve; 2],
}

impl Tables<'_> {
    /// The curves of every scene.
    pub(super) fn curves(&self) -> anyhow::Result<Vec<Scene>> {
        let scene = |case: &Case| {
            self.ticker(&case.name, "superfaces").show("curves");
            let curves = light::curves(&case.mesh, &self.device)?;
            Ok(Scene { name: short_name(case), faces: case.mesh.faces.len(), curves })
        };
        self.scenes.iter().map(scene).collect()
    }

    pub(super) fn light(&self, scenes: &[Scene]) -> anyhow::Result<String> {
        const TITLE: &str = "## [Liu99] Superfaces";
        if scenes.is_empty() {
            return Ok(format!("{TITLE}\n\nNo mesh here has light: sample:room and sample:office have.\n\n"));
        }
        let (mut table, mut rivals) = (pairs_table(), rivals_table());
        for case in self.scenes {
            let ticker = self.ticker(&case.name, "superfaces");
            for pair in PAIRS {
                ticker.show(&format!("at ε {}, δ {}", pair[0], pair[1]));
                let row = light::row(&case.mesh, pair, self.repeats, &metrics::Options::default(), &self.device)?;
                table.rows.push(pair_row(case, pair, &row.superfaces));
                rivals.rows.extend(rival_rows(case, pair, &row));
            }
        }
        Ok(format!(
            "{TITLE}\n\nThe paper prints pictures only; its pairs of ε, the step of light, and δ, the color along borders in \
             255ths, were two for a room and two for an office. Color is the difference to the scene's in red, green and blue, in \
             255ths, as mean and root mean square over its surface; held is a mean of at most δ. The distance is the greatest of \
             both sides in percent of the diagonal.\n\n{}\
             The same scenes contracted to as many faces: the default, and half-edges. Contraction carries colors along and does \
             not ask what they lose; one that asks is not here yet. × is the mean over that of superfaces.\n\n{}{}",
            table.lines(1),
            rivals.lines(2),
            curves_text(scenes)
        ))
    }
}

fn pairs_table() -> Table {
    Table::new(["scene", "ε", "δ", "superfaces", "faces", "kept", "ms", "color", "RMS", "verdict", "distance"])
}

fn pair_row(case: &Case, [epsilon, delta]: [f64; 2], trial: &Trial) -> Vec<String> {
    let color = trial.color();
    vec![
        short_name(case),
        epsilon.to_string(),
        delta.to_string(),
        trial.superfaces.map_or_else(|| "-".into(), grouped),
        grouped(trial.faces),
        format!("{:.1} %", 100.0 * trial.faces as f64 / case.mesh.faces.len() as f64),
        millis(trial.secs),
        three_digits(color.mean),
        three_digits(color.rms),
        verdict(color.mean <= delta),
        distance(trial),
    ]
}

fn distance(trial: &Trial) -> String {
    of_diagonal(trial.deviation.symmetric().max, &trial.deviation)
}

fn rivals_table() -> Table {
    Table::new(["scene", "method", "ε", "δ", "faces", "color", "RMS", "×", "distance"])
}

fn rival_rows<'a>(case: &'a Case, pair: [f64; 2], row: &'a Row) -> impl Iterator<Item = Vec<String>> + 'a {
    let own = row.superfaces.color().mean;
    light::rivals().into_iter().zip(&row.rivals).map(move |((method, _), trial)| {
        let color = trial.color();
        vec![
            short_name(case),
            method.into(),
            pair[0].to_string(),
            pair[1].to_string(),
            grouped(trial.faces),
            three_digits(color.mean),
            three_digits(color.rms),
            three_digits(color.mean / own),
            distance(trial),
        ]
    })
}

/// The curves as two tables, a column a scene.
fn curves_text(scenes: &[Scene]) -> String {
    let texts = [
        format!("Faces over ε at δ = {CURVE_DELTA}, with the share of the scene's"),
        format!("Faces over δ at ε = {CURVE_EPSILON}, with the share of the scene's"),
    ];
    let held = percent(MOST_RISE);
    let text = |(which, text): (usize, &String)| {
        let tolerance = ["ε", "δ"][which];
        let mut table = Table::new([tolerance].into_iter().chain(scenes.iter().map(|scene| scene.name.as_str())));
        for (i, pair) in scenes[0].curves[which].pairs.iter().enumerate() {
            let count = |scene: &Scene| {
                let faces = scene.curves[which].faces[i];
                format!("{}, {:.1} %", grouped(faces), 100.0 * faces as f64 / scene.faces as f64)
            };
            table.rows.push([pair[which].to_string()].into_iter().chain(scenes.iter().map(count)).collect());
        }
        let rise = |scene: &Scene| {
            let curve = &scene.curves[which];
            format!("{} % ({})", few_digits(100.0 * curve.rise()), verdict(curve.is_held()))
        };
        table.rows.push(["rise".into()].into_iter().chain(scenes.iter().map(rise)).collect());
        format!("{text}. The rise is above the least before; held is up to {held}.\n\n{}", table.lines(1))
    };
    texts.iter().enumerate().map(text).collect()
}

/// The curves as lines, for a picture: the share of faces over ε, and over δ.
pub fn lines(scenes: &[Scene]) -> [Vec<Line>; 2] {
    [0, 1].map(|which| {
        let line = |scene: &Scene| {
            let curve = &scene.curves[which];
            let share = |&faces: &usize| faces as f64 / scene.faces as f64;
            let points = curve.pairs.iter().map(|pair| pair[which]).zip(curve.faces.iter().map(share)).collect();
            Line { label: scene.name.clone(), points }
        };
        scenes.iter().map(line).collect()
    })
}
