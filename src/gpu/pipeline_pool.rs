//! What nobody uses at the moment, for whoever wants the same again.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// So many are kept: what the last few users had. `check`, which works on many scenes in turn, makes 239 pipelines instead of 502
/// with them, and 227 if all are kept.
const MOST: usize = 8;

/// The last few things that were given back, by all that they depend on.
pub(crate) struct PipelinePool<T>(Mutex<VecDeque<(Vec<u8>, T)>>);

impl<T> Default for PipelinePool<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T> PipelinePool<T> {
    /// One that was made for exactly this.
    pub fn take(&self, identity: &[u8]) -> Option<T> {
        let mut spares = self.lock();
        let place = spares.iter().rposition(|(of, _)| of == identity)?;
        spares.remove(place).map(|(_, spare)| spare)
    }

    /// Gives one back. Returns the one that has to go for it.
    #[must_use]
    pub fn give_back(&self, identity: Vec<u8>, spare: T) -> Option<T> {
        let mut spares = self.lock();
        spares.push_back((identity, spare));
        if spares.len() > MOST { spares.pop_front().map(|(_, oldest)| oldest) } else { None }
    }

    /// All that are left.
    pub fn take_all(&self) -> Vec<T> {
        self.lock().drain(..).map(|(_, spare)| spare).collect()
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<(Vec<u8>, T)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_asks_gets_the_same_kind_once() {
        let pipeline_pool = PipelinePool::default();
        for (identity, spare) in [("a", 1), ("b", 2), ("a", 3)] {
            assert_eq!(pipeline_pool.give_back(identity.into(), spare), None);
        }
        assert_eq!(
            ["c", "a", "a", "a", "b"].map(|i| pipeline_pool.take(i.as_bytes())),
            [None, Some(3), Some(1), None, Some(2)]
        );
    }

    #[test]
    fn the_oldest_goes_for_the_one_too_many() {
        let pipeline_pool = PipelinePool::default();
        let gone: Vec<_> = (0..MOST + 2).filter_map(|i| pipeline_pool.give_back(vec![i as u8], i)).collect();
        assert_eq!(gone, [0, 1]);
        assert_eq!(pipeline_pool.take(&[1]), None);
        assert_eq!(pipeline_pool.take_all(), (2..MOST + 2).collect::<Vec<_>>());
        assert!(pipeline_pool.take_all().is_empty());
    }
}
