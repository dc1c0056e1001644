#![allow(missing_docs)]
use slipwatch::{fit::*, forecast::*, reading::*, runtime::ingest};
fn main() {
    let mut args = std::env::args().skip(1);
    let path = args.next().unwrap();
    let bench = args.next().unwrap();
    let avg: f64 = args.next().unwrap().parse().unwrap();
    let evac: f64 = args.next().unwrap().parse().unwrap();
    let every: usize = args.next().unwrap().parse().unwrap();
    let (rec, _) = ingest::read_files(
        &[std::path::PathBuf::from(path.clone())],
        &ingest::ReadOptions::default(),
    )
    .unwrap();
    let id = BenchmarkId::new(bench.clone());
    let s = rec
        .series
        .iter()
        .find(|s| s.benchmark == id)
        .unwrap_or(&rec.series[0]);
    let t0 = s.readings[0].time;
    let mut obs = Observations {
        quantity: s.quantity(),
        averaging_days: avg / 24.0,
        values: vec![],
    };
    let mut panel = Panel::default();
    let start = std::time::Instant::now();
    for (i, r) in s.readings.iter().enumerate() {
        obs.values.push(Observation {
            t_days: days_since(t0, r.time),
            value: r.value * s.unit.factor(),
            sigma: None,
        });
        let Some(o) = panel.update(&obs, 1000.0) else {
            continue;
        };
        if i % every != 0 && i + 1 != s.readings.len() {
            continue;
        }
        let n = o.rates.len();
        let line = InverseVelocityLine::fit(&o.rates[n - (n / 4).max(8).min(n)..]);
        let q = |s| {
            o.passage
                .quantile(s, 4000.0)
                .map_or("-".into(), |d: f64| format!("{:.2}", d))
        };
        println!("   {}", panel.debug2());
        println!(
            "{} t={:.2} n={} v={:.2} Pe={:.3} P30={:.3} q=[{} {} {}] line={} | {} | w {}",
            r.time,
            obs.values[i].t_days,
            n,
            o.velocity_mm_per_day,
            o.passage.chance_within(evac / 24.0),
            o.passage.chance_within(30.0),
            q(0.05),
            q(0.5),
            q(0.95),
            line.and_then(|l| l.intercept_days)
                .map_or("-".into(), |d| format!("{:.2}", d - obs.values[i].t_days)),
            o.regimes
                .values()
                .map(|v| format!("{v:.2}"))
                .collect::<Vec<_>>()
                .join(" "),
            panel.debug()
        );
    }
    eprintln!("{:?}", start.elapsed());
}
