//! Tests the stored data on a flash whose power is cut at any operation.

mod cuts;
mod device;
mod limits;
mod mock;
mod random;
mod worn;
