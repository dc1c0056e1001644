//! Declared resets, as they act on the readings of one benchmark that are looked at.

use crate::monitor::{Declaration, Declared};
use crate::reading::suspicion::scatter_of;
use crate::reading::{BenchmarkId, Timestamp, Unit, whole_figure};

/// What is declared to be a jump and what the readings show differ by more than so many times the scatter of their steps,
const SCATTERS: f64 = 10.0;
/// and by more than this share of the larger of both.
const SHARE: f64 = 0.5;

/// When the zero of a benchmark's instrument changed, and by how many mm where that is declared.
#[derive(Debug, Clone, Default)]
pub(super) struct DeclaredResets(Vec<(Timestamp, Option<f64>)>);

impl DeclaredResets {
    pub(super) fn of(declared: &[Declared], benchmark: &BenchmarkId) -> Self {
        let resets = declared.iter().filter_map(|one| match one.kind {
            Declaration::Reset { size_mm } => {
                let is_here = one.benchmark.as_ref().is_none_or(|id| id == benchmark);
                is_here.then_some((one.time, size_mm))
            }
            Declaration::Maintenance { .. } | Declaration::Blast => None,
        });
        let mut resets: Vec<_> = resets.collect();
        resets.sort_by_key(|(time, _)| *time);
        Self(resets)
    }

    /// Displacements in `unit`, in order of time, without what they jump by at the resets, and what contradicts a declared size.
    pub(super) fn taken_off(
        &self,
        readings: &[(Timestamp, f64)],
        unit: Unit,
    ) -> (Vec<(Timestamp, f64)>, Vec<String>) {
        let (mut moved, mut doubts) = (readings.to_vec(), Vec::new());
        if self.0.is_empty() {
            return (moved, doubts);
        }
        let steps: Vec<f64> = readings
            .windows(2)
            .map(|pair| pair[1].1 - pair[0].1)
            .collect();
        let (usual, scatter) = scatter_of(&steps).unwrap_or_default();
        for (time, size_mm) in &self.0 {
            let after = readings.partition_point(|(read, _)| read < time);
            if after == 0 || after == readings.len() {
                continue;
            }
            let (before, here) = (readings[after - 1].1, readings[after].1);
            let step = here - before - usual;
            let size = size_mm.map(|size| size / unit.factor());
            let jump = size.unwrap_or(step);
            let apart = (step - jump).abs();
            if apart > SCATTERS * scatter && apart > SHARE * step.abs().max(jump.abs()) {
                doubts.push(format!(
                    "the reset declared for {time} has a size of {} {unit}, and the readings go from {before} to {here} {unit} there: \
                     are its sign and its unit right? Its size is what the readings jump by",
                    whole_figure(jump)
                ));
            }
            for (_, value) in &mut moved[after..] {
                *value -= jump;
            }
        }
        (moved, doubts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reading::{Quantity, suspicion};
    use jiff::ToSpan;

    #[test]
    fn a_declared_reset_is_no_fall_and_a_size_that_contradicts_the_readings_is_said() {
        let start: Timestamp = "2026-11-01T00:00:00Z".parse().unwrap();
        let at = |hour: i64| start + hour.hours();
        let value = |hour: i64| 0.1 * hour as f64 + 0.2 * (hour % 3) as f64;
        let readings = |jump: f64| -> Vec<(Timestamp, f64)> {
            (0..100)
                .map(|hour| (at(hour), value(hour) + if hour < 60 { 0.0 } else { jump }))
                .collect()
        };
        let of = |size_mm| {
            let declared = Declared {
                time: start + 3570.minutes(),
                benchmark: None,
                kind: Declaration::Reset { size_mm },
            };
            DeclaredResets::of(&[declared], &BenchmarkId::new("A"))
        };
        let is_plain = |readings: &[(Timestamp, f64)]| {
            suspicion::of_values(readings, Quantity::Displacement, "mm").is_empty()
        };
        assert!(!is_plain(&readings(-35.0)));
        for size in [None, Some(-35.0)] {
            let (moved, doubts) = of(size).taken_off(&readings(-35.0), Unit::MM);
            assert!(is_plain(&moved) && doubts.is_empty(), "{size:?}");
        }
        for size in [35.0, -35_000.0] {
            let (_, doubts) = of(Some(size)).taken_off(&readings(-35.0), Unit::MM);
            assert!(doubts[0].contains("2026-11-03T11:30:00Z"), "{doubts:?}");
        }
    }
}
