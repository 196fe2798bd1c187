//! How large the patches are that a surface is cut into for a commit: by the surface alone, so that no thread count changes a result.

/// Vertices of the smallest patches at most: their rows fit a core's second cache, and with vertices along a space-filling curve a
/// tenth of the contractions reaches out.
const PATCH: usize = 1 << 12;
/// How many patches the next level joins to one, but for the last, of halves.
const GROWTH: usize = 16;
/// Patches that a surface is cut into at least: two threads share three or five badly.
const FEWEST: usize = 8;
/// Vertices from which a surface is cut: below, rounds are cheap, and with few faces left the order counts.
pub const CUT: usize = 1 << 13;
/// Vertices from which one that was large is halved, so that the end of a long run is not left to one thread.
pub const HALVED: usize = 1 << 12;
/// Vertices at the start of a run from which it was large.
pub const LARGE: usize = 1 << 15;

/// How many vertices the patches of each level have on a surface of so many, if it is cut. The halves come last, so that little is
/// left to one thread.
pub fn patch_sizes(vertices: usize, least_cut: usize) -> Vec<usize> {
    let smallest = (vertices >= CUT).then(|| PATCH.min(vertices.div_ceil(FEWEST)));
    let growing = std::iter::successors(smallest, |size| Some(size * GROWTH)).take_while(|size| 4 * size <= vertices);
    growing.chain((vertices >= least_cut).then_some(vertices.div_ceil(2))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_are_many_and_halves_come_last() {
        assert!(patch_sizes(CUT - 1, CUT).is_empty() && patch_sizes(HALVED - 1, HALVED).is_empty());
        assert_eq!(patch_sizes(CUT - 1, HALVED), [4_096]);
        for least_cut in [CUT, HALVED] {
            assert_eq!(patch_sizes(CUT, least_cut), [1_024, 4_096]);
            assert_eq!(patch_sizes(50_000, least_cut), [4_096, 25_000]);
            assert_eq!(patch_sizes(500_000, least_cut), [4_096, 65_536, 250_000]);
            assert_eq!(patch_sizes(5_000_001, least_cut), [4_096, 65_536, 1_048_576, 2_500_001]);
        }
    }
}
