//! What is allocated, counted. On its own, because the counter replaces the allocator of the process.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod law_allocations;
mod state_size;
