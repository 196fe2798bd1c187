//! \[Liu99\] beside what is measured.

use coarsen::metrics;
use coarsen::papers::light::{self, CURVE_DELTA, CURVE_EPSILON, Curve, DUELS, Duel, MOST_RISE, PAIRS, Trial};

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
        let (mut table, mut duels) = (pairs_table(), duels_table());
        let measure = metrics::Options::default();
        for case in self.scenes {
            let ticker = self.ticker(&case.name, "superfaces");
            for pair in PAIRS {
                ticker.show(&format!("at ε {}, δ {}", pair[0], pair[1]));
                let trial = light::row(&case.mesh, pair, self.repeats, &measure, &self.device)?;
                table.rows.push(pair_row(case, pair, &trial));
            }
            for delta in DUELS {
                ticker.show(&format!("and contraction at δ {delta}"));
                duels.rows.extend(duel_rows(case, delta, &light::duel(&case.mesh, delta, &measure, &self.device)?));
            }
        }
        Ok(format!(
            "{TITLE}\n\nThe paper prints pictures only; its pairs of ε, the step of light, and δ, the color along borders in \
             255ths, were two for a room and two for an office. Color is the difference to the scene's in red, green and blue, in \
             255ths, as mean and root mean square over its surface; held is a mean of at most δ. The distance is the greatest of \
             both sides in percent of the diagonal.\n\n{}\
             Superfaces as they are by default, which light does not divide, beside contractions of the same scenes to as many \
             faces that weigh what colors lose against distances: the default, and half-edges. × is the mean over that of \
             superfaces: below 1 the contraction keeps the light better.\n\n{}{}",
            table.lines(1),
            duels.lines(2),
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

fn duels_table() -> Table {
    Table::new(["scene", "method", "δ", "faces", "color", "RMS", "×", "distance"])
}

fn duel_rows<'a>(case: &'a Case, delta: f64, duel: &'a Duel) -> impl Iterator<Item = Vec<String>> + 'a {
    let own = duel.superfaces.color().mean;
    let names = light::rivals().into_iter().map(|(name, _)| name);
    let trials = [&duel.superfaces].into_iter().chain(&duel.rivals);
    ["superfaces"].into_iter().chain(names).zip(trials).map(move |(name, trial)| {
        let color = trial.color();
        vec![
            short_name(case),
            name.into(),
            delta.to_string(),
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
