//! Of what the hooks are to be notified: written with the events that cause it, ticked off when a hook has taken it.

use super::sealed::{seal, unseal};
use super::sum::sum;
use super::{Inner, Store, StoreError, nanoseconds, timestamp};
use crate::reading::Timestamp;
use rusqlite::types::{FromSql, ValueRef};
use rusqlite::{Connection, Row, params};

/// A delivery that no hook has taken yet.
pub(super) const WAITING: &str = "waiting";

/// Which message of which alert.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AlertIdentity<'a> {
    /// The alert's idempotency key.
    pub key: &'a str,
    /// Its level.
    pub level: &'a str,
    /// Firing, resolved or a correction.
    pub state: &'a str,
}

/// One alert for one hook.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Delivery {
    /// The alert's idempotency key.
    pub key: String,
    /// Its level.
    pub level: String,
    /// Firing, resolved or correction.
    pub state: String,
    /// The hook.
    pub hook: String,
    /// When it was called, data time.
    pub time: Timestamp,
    /// When it was noted, by the host's clock.
    pub noted: Timestamp,
    /// The alert itself.
    pub body: Vec<u8>,
}

/// What became of a delivery.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeliveryOutcome {
    /// The hook did not take it: it is tried again.
    Waiting,
    /// The hook took it.
    Delivered,
    /// It was superseded or resolved before the hook took it.
    Over,
    /// It was given up.
    Dead,
    /// The config has no such hook any more, or that hook does not ask for it any more.
    Closed,
    /// Somebody acknowledged it before this hook had taken it.
    Acknowledged,
    /// Somebody silenced or shelved it before this hook, which is an escalation, was due.
    Silenced,
}

impl DeliveryOutcome {
    /// Whether an attempt led to it, as a number.
    fn attempt(self) -> i64 {
        match self {
            Self::Waiting | Self::Delivered | Self::Dead => 1,
            Self::Over | Self::Closed | Self::Acknowledged | Self::Silenced => 0,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Waiting => WAITING,
            Self::Delivered => "delivered",
            Self::Over => "over",
            Self::Dead => "dead",
            Self::Closed => "closed",
            Self::Acknowledged => "acknowledged",
            Self::Silenced => "silenced",
        }
    }

    fn named(name: &str) -> Option<Self> {
        let all = [
            Self::Waiting,
            Self::Delivered,
            Self::Over,
            Self::Dead,
            Self::Closed,
            Self::Acknowledged,
            Self::Silenced,
        ];
        all.into_iter().find(|one| one.name() == name)
    }
}

impl Delivery {
    pub(super) fn insert(&self, connection: &Connection, status: &str) -> Result<(), StoreError> {
        let mut insert = connection.prepare_cached(
            "INSERT OR IGNORE INTO outbox (key, level, state, hook, status, time, body, sum, noted)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
        )?;
        let Self {
            key,
            level,
            state,
            hook,
            time,
            body,
            noted,
        } = self;
        let (time, noted) = (nanoseconds(*time)?, nanoseconds(*noted)?);
        let beside = [
            ValueRef::Text(key.as_bytes()),
            ValueRef::Text(level.as_bytes()),
            ValueRef::Text(state.as_bytes()),
            ValueRef::Text(hook.as_bytes()),
            ValueRef::Integer(time),
        ];
        let body = seal(&beside, body);
        let sum = standing_sum(status, 0);
        insert.execute(params![
            key, level, state, hook, status, time, body, sum, noted
        ])?;
        Ok(())
    }

    /// It was noted when it was for the first hook of all: an escalation counts its time from there, whatever command line its hook
    /// has meanwhile.
    fn note_as_others(&self, connection: &Connection) -> Result<(), StoreError> {
        let Self {
            key,
            level,
            state,
            hook,
            ..
        } = self;
        let mut update = connection.prepare_cached(
            "UPDATE outbox SET noted = coalesce(
                 (SELECT min(noted) FROM outbox WHERE key = ?1 AND level = ?2 AND state = ?3), noted)
             WHERE key = ?1 AND level = ?2 AND state = ?3 AND hook = ?4",
        )?;
        update.execute(params![key, level, state, hook])?;
        Ok(())
    }
}

impl Store {
    /// The bodies of the alerts that some hook has not taken yet, the oldest first.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn waiting(&self) -> Result<Vec<Vec<u8>>, StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare(
            "SELECT id, key, level, state, hook, time, body FROM outbox WHERE status = 'waiting'
             GROUP BY key, level, state ORDER BY min(id)",
        )?;
        let mut rows = query.query([])?;
        let mut bodies = Vec::new();
        while let Some(row) = rows.next()? {
            match body(row)? {
                Some(body) => bodies.push(body),
                // What is in force is sent again when the past has been read.
                None => {
                    tracing::error!(id = ?row.get_ref(0)?, "an alert that waited is not what was written");
                }
            }
        }
        Ok(bodies)
    }

    /// The hooks that have not taken this alert yet and are still to.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn awaited(&self, alert: AlertIdentity<'_>) -> Result<Vec<String>, StoreError> {
        let AlertIdentity { key, level, state } = alert;
        let query = "SELECT hook FROM outbox
             WHERE key = ?1 AND level = ?2 AND state = ?3 AND status = 'waiting'";
        self.rows(query, params![key, level, state], |row| row.get(0))
    }

    /// Ends deliveries that nothing will make, and has their alerts wait for other hooks in the same transaction. `singly`: what one of
    /// those was to report too, and waits by itself now.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn close_deliveries(
        &self,
        ended: &[Delivery],
        instead: &[Delivery],
        singly: &[Delivery],
    ) -> Result<(), StoreError> {
        let mut inner = self.inner();
        inner.trusted()?;
        let written = inner.close_deliveries(ended, instead, singly);
        inner.committed(ended.len(), written)
    }

    /// Whether a hook's delivery with this key, level and state was ever noted; with `status`, stands so.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn is_noted(
        &self,
        alert: AlertIdentity<'_>,
        hook: Option<&str>,
        fate: Option<DeliveryOutcome>,
    ) -> Result<bool, StoreError> {
        let AlertIdentity { key, level, state } = alert;
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT 1 FROM outbox WHERE key = ?1 AND level = ?2 AND state = ?3
             AND (?4 IS NULL OR hook = ?4) AND (?5 IS NULL OR status = ?5) LIMIT 1",
        )?;
        Ok(query.exists(params![
            key,
            level,
            state,
            hook,
            fate.map(DeliveryOutcome::name)
        ])?)
    }

    /// How a hook's delivery with this key, level and state stands; `None` where it was never noted.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn outcome_of(
        &self,
        alert: AlertIdentity<'_>,
        hook: &str,
    ) -> Result<Option<DeliveryOutcome>, StoreError> {
        let status: Option<String> = self.of_delivery("status", alert, hook)?;
        Ok(status.and_then(|status| DeliveryOutcome::named(&status)))
    }

    /// The bodies of the alerts whose key begins so that have gone to some hook, of whose end none was noted.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn without_end(&self, begins: &str) -> Result<Vec<Vec<u8>>, StoreError> {
        let inner = self.inner();
        let mut query = inner.connection.prepare(
            "SELECT id, key, level, state, hook, time, body FROM outbox AS own
             WHERE substr(key, 1, length(?1)) = ?1 AND state = 'firing'
             AND NOT EXISTS (SELECT 1 FROM outbox WHERE key = own.key AND state = 'resolved')
             GROUP BY key ORDER BY min(id)",
        )?;
        let mut rows = query.query(params![begins])?;
        let mut bodies = Vec::new();
        while let Some(row) = rows.next()? {
            bodies.extend(body(row)?);
        }
        Ok(bodies)
    }

    /// How often a hook has been tried with this key, level and state, over restarts too.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn attempts(&self, alert: AlertIdentity<'_>, hook: &str) -> Result<u32, StoreError> {
        let attempts = self.of_delivery("attempts", alert, hook)?;
        Ok(attempts.unwrap_or(0))
    }

    /// When a hook's delivery was noted, by the host's clock; `None` where it was not, or by an earlier version.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn noted(
        &self,
        alert: AlertIdentity<'_>,
        hook: &str,
    ) -> Result<Option<Timestamp>, StoreError> {
        let noted: Option<Option<i64>> = self.of_delivery("noted", alert, hook)?;
        noted.flatten().map(timestamp).transpose()
    }

    /// A column of a hook's delivery with this key, level and state; `None` where it was never noted.
    fn of_delivery<T: FromSql>(
        &self,
        column: &'static str,
        alert: AlertIdentity<'_>,
        hook: &str,
    ) -> Result<Option<T>, StoreError> {
        let AlertIdentity { key, level, state } = alert;
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(&format!(
            "SELECT {column} FROM outbox WHERE key = ?1 AND level = ?2 AND state = ?3 AND hook = ?4"
        ))?;
        let mut rows = query.query(params![key, level, state, hook])?;
        Ok(rows.next()?.map(|row| row.get(0)).transpose()?)
    }

    /// The time that hooks were given of this key, level and state; `None` where none was.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn time_given(&self, alert: AlertIdentity<'_>) -> Result<Option<Timestamp>, StoreError> {
        let AlertIdentity { key, level, state } = alert;
        let inner = self.inner();
        let mut query = inner.connection.prepare_cached(
            "SELECT min(time) FROM outbox WHERE key = ?1 AND level = ?2 AND state = ?3",
        )?;
        let given: Option<i64> = query.query_row(params![key, level, state], |row| row.get(0))?;
        given.map(timestamp).transpose()
    }

    /// Notes what became of deliveries; with those that were not noted before.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn record_outcomes(
        &self,
        outcomes: &[(Delivery, DeliveryOutcome)],
    ) -> Result<(), StoreError> {
        let mut inner = self.inner();
        inner.trusted()?;
        let written = inner.record_outcomes(outcomes);
        inner.committed(outcomes.len(), written)
    }
}

/// The body of a row of number, key, level, state, hook, time and body; `None` where the row is not what was written.
pub(super) fn body(row: &Row<'_>) -> Result<Option<Vec<u8>>, StoreError> {
    let beside = (1..6).map(|index| row.get_ref(index));
    let beside: Vec<ValueRef<'_>> = beside.collect::<Result<_, _>>()?;
    let sealed: Vec<u8> = row.get(6)?;
    Ok(unseal(&beside, &sealed).map(<[u8]>::to_vec))
}

/// Whether the status and the attempts of a row, which stand with their sum behind what [`body`] takes, are what was
/// written.
pub(super) fn stands_as_written(row: &Row<'_>) -> Result<bool, StoreError> {
    let (status, attempts): (String, i64) = (row.get(7)?, row.get(8)?);
    let written: Option<i64> = row.get(9)?;
    Ok(written.is_none_or(|written| written == standing_sum(&status, attempts)))
}

pub(super) fn standing_sum(status: &str, attempts: i64) -> i64 {
    sum(&[
        ValueRef::Text(status.as_bytes()),
        ValueRef::Integer(attempts),
    ])
}

/// How a delivery stands.
struct DeliveryState {
    id: i64,
    status: String,
    attempts: i64,
}

impl DeliveryState {
    /// Of this delivery, where it was noted.
    fn of(connection: &Connection, delivery: &Delivery) -> Result<Option<Self>, StoreError> {
        let mut query = connection.prepare_cached(
            "SELECT id, status, attempts FROM outbox WHERE key = ?1 AND level = ?2 AND state = ?3 AND hook = ?4",
        )?;
        let Delivery {
            key,
            level,
            state,
            hook,
            ..
        } = delivery;
        let mut rows = query.query(params![key, level, state, hook])?;
        let Some(row) = rows.next()? else {
            return Ok(None);
        };
        Ok(Some(Self {
            id: row.get(0)?,
            status: row.get(1)?,
            attempts: row.get(2)?,
        }))
    }

    fn becomes(
        &self,
        connection: &Connection,
        fate: DeliveryOutcome,
        attempts: i64,
    ) -> Result<(), StoreError> {
        let sum = standing_sum(fate.name(), attempts);
        connection
            .prepare_cached("UPDATE outbox SET status = ?2, attempts = ?3, sum = ?4 WHERE id = ?1")?
            .execute(params![self.id, fate.name(), attempts, sum])?;
        Ok(())
    }
}

impl Inner {
    fn close_deliveries(
        &mut self,
        ended: &[Delivery],
        instead: &[Delivery],
        singly: &[Delivery],
    ) -> Result<(), StoreError> {
        let transaction = self.connection.transaction()?;
        for delivery in instead {
            delivery.insert(&transaction, WAITING)?;
            delivery.note_as_others(&transaction)?;
        }
        for delivery in singly {
            delivery.insert(&transaction, WAITING)?;
            let standing = DeliveryState::of(&transaction, delivery)?;
            // Over: it was reported by the one that is closed now.
            let is_over = |row: &DeliveryState| row.status == DeliveryOutcome::Over.name();
            if let Some(row) = standing.filter(is_over) {
                row.becomes(&transaction, DeliveryOutcome::Waiting, row.attempts)?;
            }
        }
        for one in ended {
            let standing = DeliveryState::of(&transaction, one)?;
            if let Some(row) = standing.filter(|row| row.status == WAITING) {
                row.becomes(&transaction, DeliveryOutcome::Closed, row.attempts)?;
            }
        }
        transaction.commit()?;
        Ok(())
    }

    fn record_outcomes(
        &mut self,
        outcomes: &[(Delivery, DeliveryOutcome)],
    ) -> Result<(), StoreError> {
        let transaction = self.connection.transaction()?;
        for (delivery, fate) in outcomes {
            delivery.insert(&transaction, WAITING)?;
            let standing = DeliveryState::of(&transaction, delivery)?;
            // An attempt that was under way while somebody acknowledged it may still have gone well.
            let is_done = |row: &DeliveryState| match DeliveryOutcome::named(&row.status) {
                Some(DeliveryOutcome::Delivered) => true,
                Some(DeliveryOutcome::Acknowledged | DeliveryOutcome::Silenced) => {
                    *fate != DeliveryOutcome::Delivered
                }
                _ => false,
            };
            if let Some(row) = standing.filter(|row| !is_done(row)) {
                row.becomes(&transaction, *fate, row.attempts + fate.attempt())?;
            }
        }
        transaction.commit()?;
        Ok(())
    }
}
