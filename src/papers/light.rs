//! \[Liu99\]: superfaces of rooms with light, at the paper's pairs of a step of light and a color along borders.
//!
//! The paper prints pictures only. Its claims: fewer faces the greater either is, and shadows that stay. Superfaces as they are
//! by default stand beside contraction to as many faces, which weighs what colors lose against distances.

use super::median;
use crate::backend::Device;
use crate::contract::{self, Placement};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::metrics::{self, Deviation, Spread, deviation};
use crate::partition::superface::{Criterion, Options as Regions, RANGE_CAP};
use crate::partition::{Options, Superfaces};
use crate::simplify::{Budget, Method, Outcome, simplify};

/// The pairs of the paper's pictures: ε, the step of light as a share of the darker side, and δ in 255ths. Two for its room,
/// two for its office.
pub const PAIRS: [[f64; 2]; 4] = [[0.1, 2.0], [0.8, 50.0], [0.06, 1.0], [0.8, 4.0]];
/// Steps of light of the curve with δ = [`CURVE_DELTA`].
pub const EPSILONS: [f64; 10] = [0.02, 0.04, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8];
/// Colors along borders of the curve with ε = [`CURVE_EPSILON`].
pub const DELTAS: [f64; 10] = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 20.0, 30.0, 50.0];
/// δ of the curve against ε.
pub const CURVE_DELTA: f64 = 2.0;
/// ε of the curve against δ.
pub const CURVE_EPSILON: f64 = 0.8;
/// Colors along borders at which superfaces as they are by default are compared with contraction, in 255ths.
pub const DUELS: [f64; 5] = [0.12, 0.27, 0.6, 1.3, 4.0];
/// How far a curve may rise above where it has been.
pub const MOST_RISE: f64 = 0.02;

/// Superfaces at a pair, their vertices the input's as in the paper.
pub fn superfaces([epsilon, delta]: [f64; 2]) -> Method {
    let regions = Regions { criterion: Criterion::Contrast { epsilon, range_cap: RANGE_CAP }, ..Regions::default() };
    Method::Partition(Options::superfaces(Superfaces {
        regions,
        border_color: delta,
        slides: false,
        ..Superfaces::default()
    }))
}

/// What superfaces are compared with, by name.
pub fn rivals() -> [(&'static str, Method); 2] {
    let half_edges = contract::Options { placement: Placement::Endpoint, ..contract::Options::default() };
    [("contraction", Method::default()), ("half-edges", Method::Contract(half_edges))]
}

/// What one method made of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Superfaces, of which there are none by contraction.
    pub superfaces: Option<usize>,
    /// Faces of the result.
    pub faces: usize,
    /// Seconds of the whole call.
    pub secs: f64,
    /// From the scene to the result and back.
    pub deviation: Deviation,
}

impl Trial {
    fn new(mesh: &Mesh, outcome: &Outcome, measure: &metrics::Options, device: &Device) -> Result<Self> {
        Ok(Self {
            superfaces: outcome.regions.as_ref().map(|regions| regions.count),
            faces: outcome.mesh.faces.len(),
            secs: outcome.seconds.total,
            deviation: deviation(mesh, &outcome.mesh, measure, device)?,
        })
    }

    /// The difference of color over the scene, Euclidean, in 255ths of a channel.
    pub fn color(&self) -> Spread {
        let rgb = self.deviation.forward.colors.map_or(Spread::default(), |colors| colors.rgb);
        Spread { max: 255.0 * rgb.max, mean: 255.0 * rgb.mean, rms: 255.0 * rgb.rms }
    }
}

/// Runs superfaces at `pair`, `repeats` more times for their seconds.
///
/// # Errors
/// As [`simplify()`] and [`deviation()`].
pub fn row(scene: &Mesh, pair: [f64; 2], repeats: usize, measure: &metrics::Options, device: &Device) -> Result<Trial> {
    let run = || simplify(scene, &superfaces(pair), &Budget::default(), device, None);
    let mut trial = Trial::new(scene, &run()?, measure, device)?;
    let turns: Vec<f64> = (0..repeats).map(|_| Ok(run()?.seconds.total)).collect::<Result<_>>()?;
    if !turns.is_empty() {
        trial.secs = median(turns);
    }
    Ok(trial)
}

/// Superfaces of a scene as they are by default, and the [`rivals`] with as many faces.
#[derive(Debug, Clone, PartialEq)]
pub struct Duel {
    /// The superfaces.
    pub superfaces: Trial,
    /// One a rival.
    pub rivals: Vec<Trial>,
}

/// Runs superfaces and the [`rivals`] once, the former with this color along borders.
///
/// # Errors
/// As [`simplify()`] and [`deviation()`].
pub fn duel(scene: &Mesh, border_color: f64, measure: &metrics::Options, device: &Device) -> Result<Duel> {
    let run = |method: &Method, budget: &Budget| {
        Trial::new(scene, &simplify(scene, method, budget, device, None)?, measure, device)
    };
    let by_default = Options::superfaces(Superfaces { border_color, ..Superfaces::default() });
    let superfaces = run(&Method::Partition(by_default), &Budget::default())?;
    let budget = Budget::faces(superfaces.faces);
    let rivals = rivals().iter().map(|(_, method)| run(method, &budget)).collect::<Result<_>>()?;
    Ok(Duel { superfaces, rivals })
}

/// Faces over one of the two tolerances.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The pairs, the tolerance that varies rising.
    pub pairs: Vec<[f64; 2]>,
    /// Faces of the result at each.
    pub faces: Vec<usize>,
}

impl Curve {
    fn new(scene: &Mesh, pairs: Vec<[f64; 2]>, device: &Device) -> Result<Self> {
        let count = |&pair: &[f64; 2]| {
            Ok(simplify(scene, &superfaces(pair), &Budget::default(), device, None)?.mesh.faces.len())
        };
        Ok(Self { faces: pairs.iter().map(count).collect::<Result<_>>()?, pairs })
    }

    /// By how much the curve rises above the least before, as a share of that: 0 where it never does.
    pub fn rise(&self) -> f64 {
        let mut least = f64::INFINITY;
        let mut rise = 0.0_f64;
        for &faces in &self.faces {
            least = least.min(faces as f64);
            rise = rise.max((faces as f64 - least) / least);
        }
        rise
    }

    /// Whether it falls, but for [`MOST_RISE`].
    pub fn is_held(&self) -> bool {
        self.rise() <= MOST_RISE
    }
}

/// Faces over ε, and over δ.
///
/// # Errors
/// As [`simplify()`].
pub fn curves(scene: &Mesh, device: &Device) -> Result<[Curve; 2]> {
    let by_epsilon = EPSILONS.map(|epsilon| [epsilon, CURVE_DELTA]).to_vec();
    let by_delta = DELTAS.map(|delta| [CURVE_EPSILON, delta]).to_vec();
    Ok([Curve::new(scene, by_epsilon, device)?, Curve::new(scene, by_delta, device)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::sample;

    #[test]
    fn a_duel_is_between_as_many_faces() {
        let room = sample("room", Some(3000)).unwrap();
        let (measure, device) = (metrics::Options::default(), Device::cpu(1).unwrap());
        let by_paper = row(&room, PAIRS[0], 1, &measure, &device).unwrap();
        assert!(by_paper.faces < room.faces.len() && by_paper.secs > 0.0);
        let Duel { superfaces, rivals } = duel(&room, DUELS[2], &measure, &device).unwrap();
        assert!(superfaces.superfaces.is_some_and(|count| count < superfaces.faces));
        assert!(superfaces.color().mean > 0.0 && superfaces.color().mean < superfaces.color().rms);
        for rival in rivals {
            assert!(rival.superfaces.is_none() && rival.faces.abs_diff(superfaces.faces) <= 1, "{rival:?}");
        }
    }

    #[test]
    fn curves_fall_but_for_a_little() {
        let curve = |faces: &[usize]| Curve { pairs: vec![[0.1, 2.0]; faces.len()], faces: faces.to_vec() };
        assert_eq!((curve(&[]).rise(), curve(&[9, 9, 4]).rise()), (0.0, 0.0));
        assert_eq!(curve(&[200, 100, 101, 102]).rise(), 0.02, "above the least, not above the one before");
        assert!(curve(&[100, 102]).is_held() && !curve(&[100, 101, 103]).is_held());
    }
}
