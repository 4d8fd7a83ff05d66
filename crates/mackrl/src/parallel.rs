//! Work in a fixed number of pieces on any number of threads.

/// Applies `work` to every item, on up to `threads` threads (the calling one included). Items are dealt out in turn, each is
/// worked on by one thread alone, and results stay with the item: nothing depends on the number of threads.
pub(crate) fn for_each_in_parallel<T: Send>(
    threads: usize,
    items: &mut [T],
    work: impl Fn(&mut T) + Sync,
) {
    let threads = threads.clamp(1, items.len().max(1));
    if threads == 1 {
        items.iter_mut().for_each(work);
        return;
    }
    let mut hands: Vec<Vec<&mut T>> = (0..threads).map(|_| Vec::new()).collect();
    for (index, item) in items.iter_mut().enumerate() {
        hands[index % threads].push(item);
    }
    let own = hands.pop();
    std::thread::scope(|scope| {
        for hand in hands {
            scope.spawn(|| hand.into_iter().for_each(&work));
        }
        own.into_iter().flatten().for_each(&work);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_worked_on_once_whatever_the_number_of_threads() {
        for threads in [0, 1, 2, 5, 31] {
            let mut items: Vec<usize> = (0..13).collect();
            for_each_in_parallel(threads, &mut items, |item| *item *= 3);
            assert_eq!(
                items,
                (0..13).map(|i| 3 * i).collect::<Vec<_>>(),
                "{threads} threads"
            );
        }
    }
}
