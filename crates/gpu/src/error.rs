//! Why something could not be done on a GPU.

/// What went wrong, with the adapter's name and what can be done.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There is no adapter, or none of the name asked for.
    #[error("no GPU {wanted}: {found}; on Linux a software one comes with Mesa's Vulkan drivers")]
    NoAdapter {
        /// What was asked for.
        wanted: String,
        /// What there is.
        found: String,
    },
    /// A device could not be opened.
    #[error("{adapter}: the device cannot be opened: {problem}")]
    Device {
        /// Name of the adapter.
        adapter: String,
        /// What the driver says.
        problem: String,
    },
    /// The device went away, or does not answer.
    #[error("{adapter}: the device was lost: {problem}; reset the driver or use the CPU")]
    Lost {
        /// Name of the adapter.
        adapter: String,
        /// What the driver says.
        problem: String,
    },
    /// Something does not fit the limits that every WebGPU device has.
    #[error("{adapter}: {what} takes {needed}, the limit is {limit}; use a smaller scene or the CPU")]
    Limits {
        /// Name of the adapter.
        adapter: String,
        /// What does not fit.
        what: &'static str,
        /// What it takes.
        needed: u64,
        /// What there may be.
        limit: u64,
    },
    /// The device's memory is full.
    #[error("{adapter}: out of memory for {what}; use a smaller cube or the CPU")]
    OutOfMemory {
        /// Name of the adapter.
        adapter: String,
        /// What was made.
        what: &'static str,
    },
    /// A shader or a command was refused.
    #[error("{adapter}: {what} was refused: {problem}")]
    Shader {
        /// Name of the adapter.
        adapter: String,
        /// Which.
        what: &'static str,
        /// What the driver says.
        problem: String,
    },
}

/// Result of an operation on a GPU.
pub type Result<T> = std::result::Result<T, Error>;
