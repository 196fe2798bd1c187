//! \[Liu99\]: superfaces of rooms with light, at the paper's pairs of a step of light and a color along borders.
//!
//! The paper prints pictures only. Its claims: fewer faces the greater either is, and shadows that stay. Beside them stands what
//! contraction to as many faces makes of the same scene, which carries colors along and does not ask what they lose.

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
/// How far a curve may rise above where it has been.
pub const MOST_RISE: f64 = 0.02;

/// Superfaces at a pair.
pub fn superfaces([epsilon, delta]: [f64; 2]) -> Method {
    let regions = Regions { criterion: Criterion::Contrast { epsilon, range_cap: RANGE_CAP }, ..Regions::default() };
    Method::Partition(Options::superfaces(Superfaces { regions, border_color: delta, ..Superfaces::default() }))
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

/// Superfaces of a scene at a pair, and the [`rivals`] with as many faces.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The superfaces.
    pub superfaces: Trial,
    /// One a rival.
    pub rivals: Vec<Trial>,
}

/// Runs superfaces at `pair`, `repeats` more times for their seconds, and the [`rivals`] once.
///
/// # Errors
/// As [`simplify()`] and [`deviation()`].
pub fn row(scene: &Mesh, pair: [f64; 2], repeats: usize, measure: &metrics::Options, device: &Device) -> Result<Row> {
    let run = |method: &Method, budget: &Budget| simplify(scene, method, budget, device, None);
    let (method, any) = (superfaces(pair), Budget::default());
    let mut superfaces = Trial::new(scene, &run(&method, &any)?, measure, device)?;
    let turns: Vec<f64> = (0..repeats).map(|_| Ok(run(&method, &any)?.seconds.total)).collect::<Result<_>>()?;
    if !turns.is_empty() {
        superfaces.secs = median(turns);
    }
    let budget = Budget::faces(superfaces.faces);
    let rival = |(_, method): &(_, Method)| Trial::new(scene, &run(method, &budget)?, measure, device);
    let rivals = rivals().iter().map(rival).collect::<Result<_>>()?;
    Ok(Row { superfaces, rivals })
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
    fn a_row_has_rivals_of_as_many_faces() {
        let room = sample("room", Some(3000)).unwrap();
        let row = row(&room, PAIRS[0], 1, &metrics::Options::default(), &Device::cpu(1).unwrap()).unwrap();
        let Row { superfaces, rivals } = row;
        assert!(superfaces.superfaces.is_some_and(|count| count < superfaces.faces));
        assert!(superfaces.faces < room.faces.len() && superfaces.secs > 0.0);
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
