//! The methods that are scored, under the names that scorecards print.

use super::Known;
use super::rivals;
use crate::forecast::Passage;

/// One way to say when a slope fails.
#[derive(Debug, Clone, Copy)]
pub struct Method {
    /// As scorecards print it.
    pub name: &'static str,
    /// Where it was published.
    pub source: &'static str,
    /// Whether it weighs the flow of a river, and says nothing without one.
    pub needs_flow: bool,
    /// Days from the newest reading to failure. A point forecast is one time with probability 1, a forecast that
    /// it never comes has no time; `None` where the method has nothing to say.
    pub forecast: fn(&Known) -> Option<Passage>,
}

/// Every method, the program's own first.
pub const METHODS: &[Method] = &[
    Method {
        name: "panel",
        source: "this program: what the monitor uses",
        needs_flow: false,
        forecast: rivals::panel,
    },
    Method {
        name: "slider-block",
        source: "this program: the law under an undeclared load",
        needs_flow: false,
        forecast: rivals::slider_block,
    },
    Method {
        name: "inverse-velocity-line",
        source: "Fukuzono 1985",
        needs_flow: false,
        forecast: rivals::line::raw,
    },
    Method {
        name: "inverse-velocity-short",
        source: "Carlà et al. 2017, average of 3",
        needs_flow: false,
        forecast: rivals::line::short,
    },
    Method {
        name: "inverse-velocity-long",
        source: "Carlà et al. 2017, average of 7",
        needs_flow: false,
        forecast: rivals::line::long,
    },
    Method {
        name: "voight",
        source: "Voight 1988, fitted as Crosta and Agliardi 2003",
        needs_flow: false,
        forecast: rivals::voight::forecast,
    },
    Method {
        name: "saito",
        source: "Saito 1969",
        needs_flow: false,
        forecast: rivals::saito::forecast,
    },
    Method {
        name: "exponential-threshold",
        source: "Vibert et al. 1988",
        needs_flow: false,
        forecast: rivals::exponential::forecast,
    },
    Method {
        name: "river-weighted-line",
        source: "Vibert et al. 1988, the weights ours",
        needs_flow: true,
        forecast: rivals::river::weighted_line,
    },
    Method {
        name: "river-removed-line",
        source: "Rat 1988, the fit of the share ours",
        needs_flow: true,
        forecast: rivals::river::removed_line,
    },
    Method {
        name: "tangent-angle",
        source: "Xu et al. 2009 and 2011, drawn on to 85 degrees by us",
        needs_flow: false,
        forecast: rivals::tangent::forecast,
    },
    Method {
        name: "lppls",
        source: "Filimonov and Sornette 2013; Lei and Sornette 2025",
        needs_flow: false,
        forecast: rivals::lppls::forecast,
    },
    Method {
        name: "constant-load",
        source: "Helmstetter et al. 2004",
        needs_flow: false,
        forecast: rivals::constant_load::forecast,
    },
    Method {
        name: "persistence",
        source: "none: the newest velocity goes on",
        needs_flow: false,
        forecast: rivals::persistence::forecast,
    },
];
