//! The worker threads of measurements, each on a processor of its own where asked: times then do not hang on where the
//! system moves them.

use crate::{Error, Result};

/// A pool of that many threads.
///
/// # Errors
/// [`Error::Threads`], and for pinned ones [`Error::Pin`] where there are more than processors, or the system cannot do it.
pub(crate) fn pool(threads: usize, pinned: bool) -> Result<rayon::ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    if pinned {
        let processors = processors()?;
        if processors.len() < pool.current_num_threads() {
            return Err(Error::Pin("there are more of them than processors"));
        }
        let pins = pool.broadcast(|worker| pin(processors[worker.index()]));
        pins.into_iter().collect::<Result<()>>()?;
    }
    Ok(pool)
}

/// Those that this process may use.
#[cfg(target_os = "linux")]
fn processors() -> Result<Vec<usize>> {
    use rustix::thread::{CpuSet, sched_getaffinity};
    let set = sched_getaffinity(None).map_err(|_| Error::Pin("the system does not tell the processors"))?;
    Ok((0..CpuSet::MAX_CPU).filter(|&at| set.is_set(at)).collect())
}

#[cfg(target_os = "linux")]
fn pin(processor: usize) -> Result<()> {
    use rustix::thread::{CpuSet, sched_setaffinity};
    let mut set = CpuSet::new();
    set.set(processor);
    sched_setaffinity(None, &set).map_err(|_| Error::Pin("the system refuses"))
}

#[cfg(not(target_os = "linux"))]
fn processors() -> Result<Vec<usize>> {
    Err(Error::Pin("that is possible on Linux alone"))
}

#[cfg(not(target_os = "linux"))]
fn pin(_processor: usize) -> Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn pinned_threads_keep_to_processors_of_their_own() {
        let all = processors().unwrap();
        let pool_of = |pinned| pool(all.len(), pinned).unwrap();
        let of_each = pool_of(true).broadcast(|_| processors().unwrap());
        assert_eq!(of_each, all.iter().map(|&one| vec![one]).collect::<Vec<_>>());
        assert!(
            pool_of(false)
                .broadcast(|_| processors().unwrap())
                .iter()
                .all(|of| *of == all)
        );
        assert!(matches!(pool(all.len() + 1, true), Err(Error::Pin(_))));
        assert_eq!(processors().unwrap(), all, "the caller is where it was");
    }
}
