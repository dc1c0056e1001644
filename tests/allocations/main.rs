//! What is allocated, counted. On its own, because the counter replaces the allocator of the process.

mod law_allocations;
mod state_size;
