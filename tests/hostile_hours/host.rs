//! The machine with the daemon on it.

use crate::clock::wall;
use crate::people::{Hook, Mood};
use crate::radio::Radio;
use crate::slope::Measured;
use nix::sys::resource::{Resource, getrlimit, setrlimit};
use rand_pcg::Pcg64;
use slipwatch::config::Config;
use slipwatch::monitor::Input;
use slipwatch::reading::{BenchmarkId, Reading, Unit};
use slipwatch::runtime::daemon::Daemon;
use slipwatch::runtime::deliver::{Dispatcher, Retry, Runner};
use slipwatch::runtime::delivered::Delivered;
use slipwatch::runtime::hook::Status;
use slipwatch::runtime::mqtt::ReceivedMessage;
use slipwatch::runtime::reporting::Reporting;
use slipwatch::runtime::serve::ServedState;
use slipwatch::runtime::shutdown;
use slipwatch::runtime::site::{Sinks, Site};
use slipwatch::runtime::sources::Sources;
use slipwatch::runtime::tail::Follower;
use slipwatch::store::{Batch, Presence, Store};
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Runtime;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::mpsc::{self, Sender};

/// Looks at the files in one turn; then others have waited for too long.
const MOST_LOOKS: usize = 64;
/// Messages that the daemon's channel holds.
const CHANNEL: usize = 64;
/// No file can grow beyond this while the disk is full.
pub(crate) const FULL: u64 = 8192;

/// A daemon that runs.
struct Running {
    daemon: Daemon,
    follower: Follower,
    store: Arc<Store>,
    messages: Sender<ReceivedMessage>,
    stopped: shutdown::Shutdown,
    _stop: shutdown::Trigger,
}

/// The machine.
pub(crate) struct Host<'a> {
    runtime: &'a Runtime,
    config: &'a Config,
    pub(crate) hook: Hook,
    running: Option<Running>,
    pub(crate) is_full: bool,
    /// A file at its longest does not end this process.
    _survives: Signal,
}

impl<'a> Host<'a> {
    pub(crate) fn new(runtime: &'a Runtime, config: &'a Config) -> Self {
        let of_long_files = SignalKind::from_raw(nix::sys::signal::Signal::SIGXFSZ as i32);
        Self {
            runtime,
            config,
            hook: Hook::default(),
            running: None,
            is_full: false,
            _survives: signal(of_long_files).unwrap(),
        }
    }

    pub(crate) fn is_up(&self) -> bool {
        self.running.is_some()
    }

    /// Starts the daemon as `run` does; `false` where the disk does not let it.
    pub(crate) fn start(&mut self) -> bool {
        let _limit = Limit::of(self.is_full);
        self.running = match Store::open(&self.config.site.state_dir) {
            Ok(store) => Some(self.resume(Arc::new(store))),
            Err(error) => {
                assert!(self.is_full, "{error}");
                None
            }
        };
        self.is_up()
    }

    fn resume(&self, store: Arc<Store>) -> Running {
        let delivered = Delivered::of(Arc::clone(&store));
        let hook: Arc<dyn Runner> = Arc::new(self.hook.clone());
        let alerts = Dispatcher::with(&hook, &self.config.hooks, &Retry::default(), delivered);
        let sinks = Sinks {
            store: Some(Arc::clone(&store)),
            alerts: Some(alerts),
            status: Status::Actual,
        };
        let settings = self.config.settings.clone();
        let site = Site::resume(&self.config.site.name, settings, sinks, &mut || {
            std::ops::ControlFlow::Continue(())
        })
        .unwrap()
        .unwrap();
        let reporting = self
            .runtime
            .block_on(Reporting::start(
                &self.config.site,
                Arc::default(),
                ServedState::default(),
            ))
            .unwrap();
        site.show(&reporting.vitals);
        let (stop, stopped) = shutdown::pair();
        let (messages, deliveries) = mpsc::channel(CHANNEL);
        let sources = Sources::of(messages.clone(), deliveries, shutdown::pair().0);
        let positions = store.positions().unwrap();
        let follower = Follower::new(&self.config.sources, &self.config.benchmarks, &positions);
        let daemon = Daemon::new(
            self.config,
            Arc::clone(&store),
            site,
            sources,
            reporting,
            wall,
        );
        Running {
            daemon,
            follower,
            store,
            messages,
            stopped,
            _stop: stop,
        }
    }

    /// The daemon's turns until it has nothing to do. The readings of messages that it was sent.
    pub(crate) fn turn(&mut self, radio: &mut Radio, random: &mut Pcg64) -> Vec<Measured> {
        let _limit = Limit::of(self.is_full);
        let Some(running) = &mut self.running else {
            return Vec::new();
        };
        running.look();
        let sent = radio.send(random);
        let measured = sent.iter().map(|(_, measured)| *measured).collect();
        running.listen(sent.into_iter().map(|(delivery, _)| delivery));
        running.daemon.tick().unwrap();
        while running.daemon.site.has_review_pending() {
            running.daemon.look_back().unwrap();
        }
        measured
    }

    /// Time goes by, and hooks run.
    pub(crate) fn wait(&self, span: Duration) {
        let _limit = Limit::of(self.is_full);
        self.runtime.block_on(tokio::time::sleep(span));
    }

    /// The daemon ends between two turns.
    pub(crate) fn kill(&mut self) {
        drop(self.running.take());
        // What its tasks hold goes when they are dropped.
        self.wait(Duration::from_secs(1));
    }

    /// The daemon is asked to stop.
    pub(crate) fn stop(&mut self) {
        let _limit = Limit::of(self.is_full);
        if let Some(running) = self.running.take() {
            let closed = running.daemon.site.close(wall(), Duration::from_secs(20));
            self.runtime.block_on(closed).unwrap();
        }
        self.wait(Duration::from_secs(1));
    }

    /// Whether all that it was given is on the disk.
    pub(crate) fn is_settled(&self) -> bool {
        let running = self.running.as_ref();
        running.is_some_and(|running| {
            !running.daemon.site.is_waiting() && running.daemon.site.held() == 0
        })
    }

    pub(crate) fn is_clock_wrong(&self) -> bool {
        let running = self.running.as_ref();
        running.is_some_and(|running| running.daemon.site.is_clock_wrong())
    }

    /// Whether the hook takes alerts of this benchmark.
    pub(crate) fn notifies(&self, name: &str) -> bool {
        match &self.hook.0.lock().unwrap().mood {
            Mood::Works | Mood::LosesRed => true,
            Mood::HangsAt(other) => *other != name,
            Mood::Fails | Mood::Hangs => false,
        }
    }

    pub(crate) fn store(&self) -> Option<&Store> {
        self.running.as_ref().map(|running| &*running.store)
    }

    /// Whether the reading is in the state.
    pub(crate) fn has(&self, name: &str, measured: &Measured) -> bool {
        let input = Input::Reading {
            benchmark: BenchmarkId::new(name),
            unit: Unit::MM,
            averaging: None,
            reading: Reading {
                time: measured.time,
                value: measured.value,
                sigma: None,
            },
        };
        let store = self.store().expect("the daemon runs");
        store.has(&Batch::default(), &input, 0).unwrap() != Presence::No
    }
}

impl Running {
    fn look(&mut self) {
        for _ in 0..MOST_LOOKS {
            if self.daemon.site.is_stalled() {
                return;
            }
            let batch = self.follower.poll(wall());
            let is_over = batch.caught_up && !batch.has_more;
            self.daemon.take_batch(batch, &self.stopped).unwrap();
            if is_over {
                return;
            }
        }
    }

    fn listen(&mut self, sent: impl Iterator<Item = ReceivedMessage>) {
        for delivery in sent {
            // What finds no room comes again over the next connection.
            if self.messages.try_send(delivery).is_err() {
                break;
            }
        }
        while !self.daemon.site.is_stalled() && self.daemon.sources.has_room() {
            let Ok(first) = self.daemon.sources.deliveries.try_recv() else {
                return;
            };
            self.daemon.take_messages(first).unwrap();
        }
    }
}

/// While it is there, and the disk is full, no file grows.
struct Limit(Option<(u64, u64)>);

impl Limit {
    fn of(is_full: bool) -> Self {
        let former = is_full.then(|| getrlimit(Resource::RLIMIT_FSIZE).unwrap());
        if let Some((_, hard)) = former {
            setrlimit(Resource::RLIMIT_FSIZE, FULL, hard).unwrap();
        }
        Self(former)
    }
}

impl Drop for Limit {
    fn drop(&mut self) {
        if let Some((soft, hard)) = self.0 {
            setrlimit(Resource::RLIMIT_FSIZE, soft, hard).unwrap();
        }
    }
}
