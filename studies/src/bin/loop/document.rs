//! The document: the method in short, one table of all series, a section for each.

use crate::subjects::Subject;
use crate::tables::{effect, error_cells, number, refused};
use slipwatch::effects::{Explained, Explanation, Rival};
use std::fmt::Write as _;

/// A series with what was found in it.
#[derive(Debug)]
pub(crate) struct ExplainedSubject {
    pub(crate) subject: &'static Subject,
    pub(crate) explanation: Explanation,
    /// File and caption.
    pub(crate) figures: Vec<(String, String)>,
}

const METHOD: &str = "# Closing the loop: from the residual to the missing effect

Written by `cargo run --release -p studies --bin loop`. Every number is of that run, with the default options of `slipwatch explain` and
nothing declared; the readings of some series may not be redistributed, and without them their sections are left out.

## The method in short

The law is the slider block of Helmstetter et al. (2004) in one regular equation for y = v_i / v, under a log-load f(t):

    v = v_i e^f / y,   dy/dt = a y^p − b e^f

1. Faults of the data are found first, in the readings and in the channels: resets, copied rows, stuck and interpolated values,
   outliers. They are taken out and named, and nothing is fitted to them.
2. The law under a constant load is fitted (*before*). Its residual is judged by its innovations, under a bank of noises: white, AR(1)
   for irregular sampling, random walk.
3. Every kind of effect is tried inside the law, with every channel, as level and as rate, through exponential and gamma
   responses; a value of rain is what fell since the one before it. The delay of a response is chosen about the law without it, about a
   steady law, and again about the law that was fitted with it. The law's own parameters are refitted with it, from where they stood and from laws found again, because beside a poor law
   everything that is tried gains alike; an event lies between two readings. The best one enters, and the search begins again (*after*); but
   where the law that was found with it is the better one without it too, the law before was a poor fit, nothing enters, and the search begins
   again from that law. What entered early leaves again where the BIC rises by less than 10 without it.
4. An effect is accepted only if the BIC falls by 10 or more (by 20 where only the shape of the readings supports it, or it happened at a time, and the noise does not
   remember: a random walk so small that the law takes it up looks like either), the sign is one that the ground allows, its memory is short against the
   record, a search on 399 surrogates without any effect gains as much in fewer than 1 % of cases, and a later block, held out, is predicted
   no worse by the effects as they were learned before it. That is judged by innovations, each reading of the block predicted from
   those before it, under a law that is fitted to all readings with the effect and without: where the law itself drifts is
   not in question. An effect that only the shape of the readings supports (no channel, no tide, no season) may have changed the law, and is
   judged with the law too as it was learned before the block. Extrapolated over the whole block, such an effect may not be
   worse at all, and another by a fifth at most (a covariate is not judged so where the error with it exceeds all that the
   readings range over: the law itself has failed within the block); a tide, which comes back to where it was and cannot drift, by ten times at most:
   the rest is the law's. All effects together may predict the block no worse than the law without any. A tide must gain as much more than a daily cycle of 24 and 12 hours,
   which warmth and melt water have. What is no tide and not of the reading must also account for the readings as well, within the margin, as a load
   does that changes over a while, or comes and goes, and that nothing measures; a rise over several readings is no reset. Everything
   else is listed with the reason.
5. Effects within the margin of each other stand under *cannot be separated from*; of jumps of the velocity that one comes first
   which asks less of the law by its priors. Structure that is left is called so. What only the
   shape of the readings supports must leave nothing but noise; a jump of the velocity stands beside what is left if it gains 40 or more and would
   gain less by 20 or more three readings earlier or later.

Two weak priors of the law (`src/effects/prior.rs`: a deviation of 1.5 of ln v, and of .2 of an approach to the steady state within one
interval) were set with NTOE and Baishuihe below in view; the held-out error of NTOE lay between 12 and 18 mm under others that are as plausible.
That the law of an inversion is taken for the plain one only where it leaves less than seven tenths of the error (`src/effects/search.rs`) was set with BLKM and
NTOE in view: taken whenever it is the nearer one, the held-out errors are 12.6 and 13.5 mm.

What it assumes: the load acts through the ratio of shear to normal stress only (the state's direct response to normal stress is left
out); responses are linear; covariates are measured where it matters; what is held out is the last third of the record, or half of
what follows the last dated effect. Errors are root mean squares of least-squares fits in the unit of the readings, on the same data
before and after. The held-out errors are given twice. *From reading to reading*: by how much each reading of the block is missed where
it is predicted from those before it, the effects learned before the block, the covariates known, the law fitted to all
readings. *Extrapolated*: by how much the readings themselves are missed, over the whole block at once, law and effects learned before it.
In the second, what the law has drifted by in the first months of the block counts again in every later reading, whatever the effect does; so
the first is what effects are judged by (but for jumps of the reading and the blur of a mean, which say nothing of what
comes). An effect is what the readings are consistent with, and is not proved to cause them.
";

/// The whole document.
pub(crate) fn text(explained: &[ExplainedSubject]) -> String {
    let mut out = METHOD.to_owned();
    out.push_str("\n## All series\n\nError before → after.\n\n");
    out.push_str(
        "| series | readings | first effect | fit | held out, from reading to reading | held out, extrapolated | unit |\n|---|---|---|---|---|---|---|\n",
    );
    for ExplainedSubject {
        subject,
        explanation,
        ..
    } in explained
    {
        let verdict = &explanation.verdict;
        let channel = verdict.channel.as_deref();
        let channel = channel.map_or(String::new(), |name| format!(" `{name}`"));
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "| {} | {} | `{}`{channel} | {} |",
            subject.heading,
            explanation.readings,
            verdict.effect,
            error_cells(explanation)
        );
    }
    for one in explained {
        section(&mut out, one);
    }
    out
}

fn section(out: &mut String, one: &ExplainedSubject) {
    let (subject, explanation) = (one.subject, &one.explanation);
    let _ = writeln!(out, "\n## {}\n\n{}\n", subject.heading, subject.origin);
    let _ = writeln!(out, "- Verdict: {}.", effect(&explanation.verdict));
    for also in &explanation.also {
        let _ = writeln!(out, "- Also: {}.", effect(also));
    }
    let mut rivals = explanation.cannot_separate_from.iter();
    let is_one_channel = rivals.all(|rival| rival.channel.is_none());
    let explained = match explanation.explained {
        Explained::Full => "the residual that is left cannot be distinguished from noise",
        Explained::Partly if is_one_channel => "in part: structure is left in the residual",
        Explained::Partly => "in part: which channel acts cannot be distinguished",
        Explained::None => "no effect was accepted",
    };
    let _ = writeln!(out, "- Explained: {explained}.");
    if !explanation.cannot_separate_from.is_empty() {
        let names = Rival::listed(&explanation.cannot_separate_from);
        let _ = writeln!(out, "- Cannot be separated from: {names}.");
    }
    let error = &explanation.error;
    let held_out_from = error.held_out_from;
    let from = held_out_from.map_or("–".to_owned(), |from| from.strftime("%F").to_string());
    let _ = writeln!(
        out,
        "- Error, {}: fit {} → {}; held out from {from} on: {} → {} from reading to reading, {} → {} extrapolated.",
        error.unit,
        number(error.fit.before),
        number(error.fit.after),
        number(error.held_out_step.before),
        number(error.held_out_step.after),
        number(error.held_out.before),
        number(error.held_out.after),
    );
    for remark in &explanation.remarks {
        let _ = writeln!(out, "- Remark: {remark}");
    }
    let _ = writeln!(out, "\n{}", subject.comment);
    out.push_str(&refused(explanation));
    for (file, caption) in &one.figures {
        let _ = writeln!(out, "\n![{caption}](loop/{file})");
    }
}
