//! What the search saw: the autocorrelation of the innovations, and the rivals with their margins.

use super::{Picture, title};
use crate::effects::Explanation;
use crate::plot::{Axis, BLUE, Bar, Bars, Figure, GREEN, GREY, Legend, Mark, Panel, RED};
use crate::reading::HALF_WIDTH_95;

/// Size of a panel, in the sheet's units.
const PANEL: (f64, f64) = (460.0, 240.0);
/// Width of the sheet.
const WIDTH: f64 = 920.0;
/// No figure shows more rivals.
const MOST_RIVALS: usize = 16;
/// Lags under half a day are reported in hours.
const HALF_A_DAY: f64 = 0.5;

/// The autocorrelation of the innovations with the band of white noise, before and after.
pub(super) fn autocorrelation(explanation: &Explanation) -> Option<Picture> {
    let curves = &explanation.curves;
    let count = curves.times.len() as f64;
    let band = HALF_WIDTH_95 / count.sqrt();
    if !band.is_finite() || curves.autocorrelation.before.len() < 2 {
        return None;
    }
    let (step, unit) = if curves.lag_days < HALF_A_DAY {
        (24.0 * curves.lag_days, "hours")
    } else {
        (curves.lag_days, "days")
    };
    let both = [
        ("before", &curves.autocorrelation.before, RED),
        ("after", &curves.autocorrelation.after, BLUE),
    ];
    // At lag 0 it is 1 and says nothing.
    let seen = both.iter().flat_map(|one| one.1.iter().skip(1).copied());
    let y = Axis::around("autocorrelation", seen.chain([-2.0 * band, 2.0 * band]));
    let panels = both.map(|(name, values, colour)| {
        let lags = values.iter().enumerate().skip(1);
        let points = lags.map(|(lag, value)| (step * lag as f64, *value));
        let end = step * curves.autocorrelation.before.len() as f64;
        let noise = Mark::Band {
            points: vec![(0.0, -band, band), (end, -band, band)],
            colour: GREY,
        };
        let points = points.collect();
        Panel {
            title: format!("innovations {name}"),
            x: Axis::linear(&format!("lag, {unit}"), 0.0, end),
            y: y.clone(),
            marks: vec![
                ("95 % of noise".to_owned(), noise),
                (String::new(), Mark::Stems { points, colour }),
            ],
            legend: Legend::Above,
        }
    });
    let caption = "Autocorrelation of the innovations, before and after, with the band that holds \
                   95 % of those of white noise.";
    let name = "autocorrelation";
    let figure = Figure {
        description: caption.to_owned(),
        columns: 2,
        panel: PANEL,
        panels: panels.to_vec(),
    };
    Some(Picture {
        name,
        caption: caption.to_owned(),
        svg: figure.named(name),
    })
}

/// What was tried, by how much each lowered the BIC, and why it was refused.
pub(super) fn rivals(explanation: &Explanation) -> Option<Picture> {
    let tried = &explanation.candidates;
    let bars = tried.iter().take(MOST_RIVALS).map(|candidate| {
        let refused = candidate.rejected_because.as_deref();
        Bar {
            name: title(candidate),
            value: candidate.bic_gain,
            colour: if refused.is_some() { GREY } else { GREEN },
            note: refused.map_or("accepted".to_owned(), |why| format!("refused: {why}")),
        }
    });
    let bars: Vec<Bar> = bars.filter(|bar| bar.value.is_finite()).collect();
    if bars.is_empty() {
        return None;
    }
    let margin = explanation.settings.bic_margin;
    let most = bars
        .iter()
        .map(|bar| bar.value)
        .fold(2.0 * margin, f64::max);
    let least = bars.iter().map(|bar| bar.value).fold(0.0, f64::min);
    let caption = format!(
        "The rivals: by how much each lowers the BIC against what stood when it was tried (green: \
         accepted, grey: refused). The dashed line is the margin asked for{}.",
        if tried.len() > MOST_RIVALS {
            format!("; {} more stand in the table", tried.len() - MOST_RIVALS)
        } else {
            String::new()
        }
    );
    let figure = Bars {
        description: caption.clone(),
        title: "rivals".to_owned(),
        width: WIDTH,
        // What makes things far worse is cut off: its figure stands beside it.
        axis: Axis::linear("fall of the BIC", least.max(-0.25 * most), 1.05 * most),
        mark: (margin, "margin".to_owned()),
        bars,
    };
    Some(Picture {
        name: "rivals",
        caption,
        svg: figure.svg(),
    })
}
