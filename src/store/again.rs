//! Deliveries that wait again.

use super::outbox::{WAITING, body, standing_sum};
use super::{Store, StoreError};
use rusqlite::{TransactionBehavior, params};

impl Store {
    /// Has what was given up, or closed, wait again, as if it had never been tried, but for alerts that `is_over` by their
    /// bodies. Says how many deliveries wait again and how many were left out. The daemon takes them at its next start, or
    /// when it takes its config again.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn redeliver(&self, is_over: &dyn Fn(&[u8]) -> bool) -> Result<(usize, usize), StoreError> {
        self.wait_again("status IN ('dead', 'closed')", is_over)
    }

    /// The same of what hooks have taken of the beginning of alerts: in a state that was put back they may have taken the end since.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn offer_again(
        &self,
        is_over: &dyn Fn(&[u8]) -> bool,
    ) -> Result<(usize, usize), StoreError> {
        self.wait_again(
            "status IN ('delivered', 'acknowledged') AND state = 'firing'",
            is_over,
        )
    }

    fn wait_again(
        &self,
        which: &str,
        is_over: &dyn Fn(&[u8]) -> bool,
    ) -> Result<(usize, usize), StoreError> {
        let mut inner = self.inner();
        // It reads before it writes: begun as one that reads it would be refused where the daemon has written meanwhile.
        let transaction =
            (inner.connection).transaction_with_behavior(TransactionBehavior::Immediate)?;
        let (mut again, mut left_out) = (Vec::new(), 0);
        {
            let mut query = transaction.prepare(&format!(
                "SELECT id, key, level, state, hook, time, body FROM outbox WHERE {which} ORDER BY id"
            ))?;
            let mut rows = query.query([])?;
            while let Some(row) = rows.next()? {
                let id: i64 = row.get(0)?;
                if body(row)?.is_some_and(|body| is_over(&body)) {
                    left_out += 1;
                } else {
                    again.push(id);
                }
            }
        }
        let sum = standing_sum(WAITING, 0);
        for id in &again {
            transaction
                .prepare_cached(
                    "UPDATE outbox SET status = ?2, attempts = 0, sum = ?3 WHERE id = ?1",
                )?
                .execute(params![id, WAITING, sum])?;
        }
        transaction.commit()?;
        Ok((again.len(), left_out))
    }
}
