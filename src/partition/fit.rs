//! Colors of the vertices that stay, moved so that the light between them is right on average: where light bends one way, colors
//! that are right at vertices are all off to one side between them.

use super::interior::{Color, length};
use super::surface::Surface;
use crate::mesh::adjacency::group;

/// Rounds, all but the first with samples weighted by one over how far they were off: so that what counts is the mean difference,
/// and not its square, of which hard shadows would have all.
const ROUNDS: usize = 3;
/// Sweeps over the vertices a round. Every vertex is held by its own color, so that few do.
const SWEEPS: usize = 10;
/// What is less off than this share of the tolerance counts as that.
pub const FLOOR: f64 = 0.1;
/// Light at the vertices of a face beside that in its middle: together the areas that they stand for make the integral of what
/// is quadratic exact.
pub const AT_VERTICES: f64 = 0.25;

/// Light somewhere in a triangle of the result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    pub face: u32,
    /// Of the face's corners.
    pub shares: [f64; 3],
    pub color: Color,
    /// The area that it stands for.
    pub area: f64,
}

/// The share of the area around a vertex that its own color stands for.
pub fn area_at(surface: &Surface, vertex: u32) -> f64 {
    area_around(surface, vertex) * AT_VERTICES
}

/// A third of the faces' area around a vertex.
pub fn area_around(surface: &Surface, vertex: u32) -> f64 {
    let area = |&f: &u32| area(surface, f);
    surface.rings.ring(vertex).iter().map(area).sum::<f64>() / 3.0
}

/// The area of a face of the input, in the frame.
pub fn area(surface: &Surface, face: u32) -> f64 {
    let [a, b, c] = surface.faces[face as usize].map(|v| surface.points[v as usize]);
    (b - a).cross(c - a).length() / 2.0
}

/// Sums of a triangle: the upper half of the matrix of its corners' shares, and what pulls at each corner.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    matrix: [[f64; 3]; 3],
    pull: [Color; 3],
}

/// Colors of the surface's vertices, those moved by at most `most` that `may_move`: in `faces`, between them, lie `samples`.
///
/// Gauss and Seidel's iterations of least squares, in the order of vertices: the same on any device.
pub fn fit(
    surface: &Surface,
    may_move: &[bool],
    colors: &[[f32; 4]],
    faces: &[[u32; 3]],
    samples: &[Sample],
    most: f64,
) -> Vec<[f32; 4]> {
    let own: Vec<Color> = colors.iter().map(|&[red, green, blue, _]| [red, green, blue].map(f64::from)).collect();
    let (starts, around) = group(faces.len(), own.len(), |f| faces[f]);
    let used: Vec<u32> = (0..own.len() as u32).filter(|&v| may_move[v as usize]).collect();
    let is_open = |sample: &&Sample| faces[sample.face as usize].iter().any(|&v| may_move[v as usize]);
    let samples: Vec<&Sample> = samples.iter().filter(is_open).collect();
    let held: Vec<f64> = used.iter().map(|&v| area_at(surface, v)).collect();
    let greatest = own.iter().flatten().fold(0.0, |greatest, &light| f64::max(greatest, light));
    let mut fitted = own.clone();
    let mut sums = vec![Sums::default(); faces.len()];
    for round in 0..ROUNDS {
        let weight = |area: f64, off: f64| if round == 0 { area } else { area / (off / most + FLOOR) };
        sums.fill(Sums::default());
        for sample in &samples {
            let corners = faces[sample.face as usize].map(|v| fitted[v as usize]);
            let off = |k: usize| (0..3).map(|i| sample.shares[i] * corners[i][k]).sum::<f64>() - sample.color[k];
            sums[sample.face as usize].add(sample, weight(sample.area, length([0, 1, 2].map(off))));
        }
        let hold = |(&v, &area): (&u32, &f64)| {
            let (is, was) = (fitted[v as usize], own[v as usize]);
            weight(area, length([0, 1, 2].map(|k| is[k] - was[k])))
        };
        let held: Vec<f64> = used.iter().zip(&held).map(hold).collect();
        for _ in 0..SWEEPS {
            for (&v, &hold) in used.iter().zip(&held) {
                let mut pull = own[v as usize].map(|light| hold * light);
                let mut weight = hold;
                for &f in &around[starts[v as usize] as usize..starts[v as usize + 1] as usize] {
                    let (sums, corners) = (&sums[f as usize], faces[f as usize]);
                    for i in (0..3).filter(|&i| corners[i] == v) {
                        let [j, k] = [(i + 1) % 3, (i + 2) % 3];
                        let others = [j, k].map(|other| (sums.matrix[i][other], fitted[corners[other] as usize]));
                        weight += sums.matrix[i][i];
                        for channel in 0..3 {
                            pull[channel] += sums.pull[i][channel]
                                - others.iter().map(|(share, color)| share * color[channel]).sum::<f64>();
                        }
                    }
                }
                if weight > 0.0 {
                    let was = own[v as usize];
                    let near = |k: usize| (pull[k] / weight).clamp(was[k] - most, was[k] + most).clamp(0.0, greatest);
                    fitted[v as usize] = [0, 1, 2].map(near);
                }
            }
        }
    }
    let row = |(color, row): (Color, &[f32; 4])| {
        let [red, green, blue] = color.map(|light| light as f32);
        [red, green, blue, row[3]]
    };
    fitted.into_iter().zip(colors).map(row).collect()
}

impl Sums {
    fn add(&mut self, sample: &Sample, weight: f64) {
        for i in 0..3 {
            for j in 0..3 {
                self.matrix[i][j] += weight * sample.shares[i] * sample.shares[j];
            }
            for k in 0..3 {
                self.pull[i][k] += weight * sample.shares[i] * sample.color[k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    /// One square of a plane under a light with a bulge in its middle: the corners share what the middle is brighter by, but move
    /// by no more than they may.
    #[test]
    fn corners_share_what_is_off_between_them() {
        let surface = Surface::new(&shapes::plane(1, 1), Some(0.0)).expect("a valid mesh");
        let faces = surface.faces.clone();
        // No light becomes brighter than the brightest, which is green here.
        let colors = vec![[0.5, 0.9, 0.0, 0.7]; 4];
        let sample = |face| Sample { face, shares: [1.0 / 3.0; 3], color: [0.6, 0.9, 0.0], area: area(&surface, face) };
        let samples = [sample(0), sample(1)];
        let off = |rows: &[[f32; 4]]| {
            let mean = |face: [u32; 3]| face.iter().map(|&v| rows[v as usize][0]).sum::<f32>() / 3.0;
            faces.iter().map(|&face| (mean(face) - 0.6).abs()).sum::<f32>()
        };
        let fitted = fit(&surface, &[true; 4], &colors, &faces, &samples, 0.2);
        assert!(off(&fitted) < 0.5 * off(&colors), "{fitted:?}");
        assert!(fitted.iter().all(|row| row[1..] == colors[0][1..] && row[0] > 0.5 && row[0] <= 0.6));
        let bound = fit(&surface, &[true; 4], &colors, &faces, &samples, 0.01);
        assert!(bound.iter().all(|row| (row[0] - 0.51).abs() < 1e-6), "{bound:?}");
        // What is right already stays.
        let right = Sample { color: [0.5, 0.9, 0.0], ..sample(0) };
        assert_eq!(fit(&surface, &[true; 4], &colors, &faces, &[right], 0.2), colors);
        let still = faces[0][0];
        let may_move = [0, 1, 2, 3].map(|v| v != still);
        let fitted = fit(&surface, &may_move, &colors, &faces, &samples, 0.2);
        assert!((0..4).all(|v| (fitted[v] == colors[v]) != may_move[v]), "{fitted:?}");
    }
}
