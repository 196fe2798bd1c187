//! The best triangulation of a polygon by dynamic programming: the best of every part from the best of smaller ones.

/// The best triangles on the corners `0 .. count`, each in ascending order, and what they are together; in O(k³) for k corners.
///
/// A part is what lies between two corners and the line that joins them: `side` says what it is between a corner and the next,
/// `join` what it is with a triangle between two other parts, if that is legal; `beats` compares it with the best found before.
/// `may_join` says which corners a diagonal may join. `None` without a legal triangulation.
pub(crate) fn best_triangles<P: Copy>(
    count: usize,
    side: impl Fn(usize) -> P,
    mut may_join: impl FnMut(usize, usize) -> bool,
    mut join: impl FnMut([usize; 3], [P; 2]) -> Option<P>,
    beats: impl Fn(P, Option<P>) -> bool,
) -> Option<(Vec<[usize; 3]>, P)> {
    if count < 3 {
        return None;
    }
    // Row by row, with the third corner of the triangle at the line.
    let mut parts: Vec<Option<(P, usize)>> = vec![None; count * count];
    for i in 0..count - 1 {
        parts[i * count + i + 1] = Some((side(i), i));
    }
    for length in 2..count {
        for i in 0..count - length {
            let j = i + length;
            // The last one is a side of the polygon.
            if length + 1 < count && !may_join(i, j) {
                continue;
            }
            let mut found: Option<(P, usize)> = None;
            for tip in i + 1..j {
                let (Some((first, _)), Some((second, _))) = (parts[i * count + tip], parts[tip * count + j]) else {
                    continue;
                };
                if let Some(part) = join([i, tip, j], [first, second])
                    && beats(part, found.map(|(part, _)| part))
                {
                    found = Some((part, tip));
                }
            }
            parts[i * count + j] = found;
        }
    }
    let (whole, _) = parts[count - 1]?;
    let mut triangles = Vec::with_capacity(count - 2);
    let mut open = vec![(0, count - 1)];
    while let Some((i, j)) = open.pop() {
        if let Some((_, tip)) = parts[i * count + j].filter(|_| j > i + 1) {
            triangles.push([i, tip, j]);
            open.extend([(i, tip), (tip, j)]);
        }
    }
    Some((triangles, whole))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The product of the corners summed up, least: the classic, by hand 1·2·3 + 1·3·4 = 18 against 1·2·4 + 2·3·4 = 32.
    #[test]
    fn the_least_sum_is_found() {
        let least = |weights: &[u32], barred: [usize; 2]| {
            best_triangles(
                weights.len(),
                |_| 0,
                |i, j| [i, j] != barred,
                |corners, [first, second]| Some(first + second + corners.map(|i| weights[i]).iter().product::<u32>()),
                |part, best| best.is_none_or(|best| part < best),
            )
        };
        assert_eq!(least(&[1, 2, 3, 4], [0, 0]), Some((vec![[0, 2, 3], [0, 1, 2]], 18)));
        assert_eq!(least(&[1, 2, 3, 4], [0, 2]), Some((vec![[0, 1, 3], [1, 2, 3]], 32)));
        assert_eq!(least(&[1, 2], [0, 0]), None);
    }
}
