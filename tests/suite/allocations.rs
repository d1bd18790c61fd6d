//! A global allocator that counts, so that a test can assert that a solver step allocates nothing, and a reader of files not
//! too much.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
    /// Bytes that this thread has asked for and not given back, and the most of them.
    static LIVE: Cell<[i64; 2]> = const { Cell::new([0; 2]) };
}

fn count_one() {
    // A thread that is being torn down has nobody left to ask for its count.
    let _counted = COUNT.try_with(|count| count.set(count.get() + 1));
}

fn count_bytes(bytes: i64) {
    let _counted = LIVE.try_with(|live| {
        let [now, most] = live.get();
        live.set([now + bytes, most.max(now + bytes)]);
    });
}

#[expect(unsafe_code, reason = "counting allocations takes an allocator, and its interface is unsafe")]
// SAFETY: every call is handed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count_one();
        count_bytes(layout.size() as i64);
        // SAFETY: the caller keeps the contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count_one();
        count_bytes(size as i64 - layout.size() as i64);
        // SAFETY: the caller keeps the contract.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count_bytes(-(layout.size() as i64));
        // SAFETY: the caller keeps the contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Allocations that `work` makes in this thread.
pub(crate) fn allocations_in<T>(work: impl FnOnce() -> T) -> (u64, T) {
    let before = COUNT.with(Cell::get);
    let result = work();
    (COUNT.with(Cell::get) - before, result)
}

/// Most bytes that `work` holds at once in this thread, besides those held before.
pub(crate) fn peak_of<T>(work: impl FnOnce() -> T) -> (usize, T) {
    LIVE.with(|live| live.set([0; 2]));
    let result = work();
    (LIVE.with(Cell::get)[1].max(0) as usize, result)
}

#[test]
fn allocations_are_counted() {
    let (count, boxed) = allocations_in(|| vec![Box::new(1.0), Box::new(2.0)]);
    assert_eq!((count, boxed.len()), (3, 2));
    let (peak, ()) = peak_of(|| drop([vec![0u8; 1000], vec![0u8; 500]]));
    assert_eq!(peak, 1500);
}
