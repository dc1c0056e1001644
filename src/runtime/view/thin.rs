//! Fewer points than were measured, and no extreme lost: of each stretch of time the first, the least, the greatest and
//! the last.

/// A point: seconds since 1970, and a value.
pub(super) type ThinPoint = (f64, f64);

/// At most `4 * buckets` of `points`, which are in order of time.
pub(super) fn min_max(points: &[ThinPoint], buckets: usize) -> Vec<ThinPoint> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return Vec::new();
    };
    let buckets = buckets.max(1);
    if points.len() <= 4 * buckets {
        return points.to_vec();
    }
    let width = ((last.0 - first.0) / buckets as f64).max(f64::MIN_POSITIVE);
    let mut kept = Vec::new();
    let mut start = 0;
    for bucket in 1..=buckets {
        let end = if bucket == buckets {
            points.len()
        } else {
            let until = width.mul_add(bucket as f64, first.0);
            start + points[start..].partition_point(|point| point.0 < until)
        };
        keep_extremes(&points[start..end], &mut kept);
        start = end;
    }
    kept
}

fn keep_extremes(points: &[ThinPoint], kept: &mut Vec<ThinPoint>) {
    let Some(last) = points.len().checked_sub(1) else {
        return;
    };
    let (mut least, mut greatest) = (0, 0);
    for (index, point) in points.iter().enumerate() {
        if point.1 < points[least].1 {
            least = index;
        }
        if point.1 > points[greatest].1 {
            greatest = index;
        }
    }
    let mut chosen = [0, least.min(greatest), least.max(greatest), last].to_vec();
    chosen.dedup();
    kept.extend(chosen.into_iter().map(|index| points[index]));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_of_one_reading_among_a_hundred_thousand_is_kept() {
        let mut points: Vec<ThinPoint> = (0..100_000).map(|i| (f64::from(i), 1.0)).collect();
        points[43_211].1 = 50.0;
        points[77_777].1 = -50.0;
        let kept = min_max(&points, 500);
        assert!(kept.len() <= 2000, "{}", kept.len());
        assert!(kept.contains(&(43_211.0, 50.0)) && kept.contains(&(77_777.0, -50.0)));
        assert_eq!((kept[0], kept[kept.len() - 1]), (points[0], points[99_999]));
        assert!(kept.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }

    #[test]
    fn few_points_stay_as_they_are_and_none_are_none() {
        let points: Vec<ThinPoint> = (0..10).map(|i| (f64::from(i), 0.0)).collect();
        assert_eq!(min_max(&points, 500), points);
        assert_eq!(min_max(&[], 500), []);
        let same_time = vec![(5.0, 1.0); 50];
        assert!(!min_max(&same_time, 2).is_empty());
    }
}
