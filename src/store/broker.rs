//! As whom this state's sessions are held with brokers.

use super::{Store, StoreError};
use rusqlite::params;
use std::collections::BTreeMap;

impl Store {
    /// The client's name in the session with the broker of each source that has been subscribed to.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn broker_sessions(&self) -> Result<BTreeMap<String, String>, StoreError> {
        let query = "SELECT source, client FROM broker_session";
        let rows = self.rows(query, [], |row| Ok((row.get(0)?, row.get(1)?)))?;
        Ok(rows.into_iter().collect())
    }

    /// Notes one that the broker has granted.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn note_broker_session(&self, source: &str, client: &str) -> Result<(), StoreError> {
        self.inner().connection.execute(
            "INSERT OR REPLACE INTO broker_session (source, client) VALUES (?1, ?2)",
            params![source, client],
        )?;
        Ok(())
    }

    /// Forgets that of a source which the config does not have any more.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn forget_broker_session(&self, source: &str) -> Result<(), StoreError> {
        let delete = "DELETE FROM broker_session WHERE source = ?1";
        self.inner().connection.execute(delete, [source])?;
        Ok(())
    }
}
