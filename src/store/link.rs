//! Links by which an alert is acknowledged: each can be used once.

use super::{Store, StoreError, nanoseconds};
use crate::monitor::Order;
use crate::reading::Timestamp;
use rusqlite::{TransactionBehavior, params};

impl Store {
    /// Uses a link, which is good until `until`, and leaves `order` for the daemon in the same transaction; `false`, and nothing
    /// changes, where it has been used before. What has expired by `now` is forgotten.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn use_link(
        &self,
        link: &str,
        until: Timestamp,
        now: Timestamp,
        order: Option<&Order>,
    ) -> Result<bool, StoreError> {
        let body = order.map(serde_json::to_string).transpose();
        let body = body.map_err(|error| StoreError::Unreadable(error.to_string()))?;
        let mut inner = self.inner();
        let transaction =
            (inner.connection).transaction_with_behavior(TransactionBehavior::Immediate)?;
        transaction.execute(
            "DELETE FROM used_link WHERE until < ?1",
            [nanoseconds(now)?],
        )?;
        let insert = "INSERT OR IGNORE INTO used_link (link, until) VALUES (?1, ?2)";
        let is_first = transaction.execute(insert, params![link, nanoseconds(until)?])? == 1;
        if let (true, Some(body)) = (is_first, body) {
            transaction.execute("INSERT INTO command (body) VALUES (?1)", [body])?;
        }
        transaction.commit()?;
        Ok(is_first)
    }

    /// Whether a link has been used.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn is_used(&self, link: &str) -> Result<bool, StoreError> {
        let inner = self.inner();
        let mut query =
            (inner.connection).prepare_cached("SELECT 1 FROM used_link WHERE link = ?1")?;
        Ok(query.exists([link])?)
    }
}
