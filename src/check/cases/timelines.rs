//! Submissions one after the other, which wait for each other by barriers and timeline semaphores.

use crate::check::probe::{PlainKernel, WORKGROUP};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::gpu::{Access, Recorder, Specialization};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "timeline/order",
        what: "200 submissions, three in flight, each of which goes on with what the last has left",
        oracle: "the same, one after the other",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| in_order(lab, 200, 1),
    },
    Case {
        name: "timeline/barriers",
        what: "100 submissions of eight dispatches with barriers between",
        oracle: "the same, one after the other",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| in_order(lab, 100, 8),
    },
    Case {
        name: "timeline/read-back",
        what: "words that the host reads when a submission is done, while the next is under way",
        oracle: "the same, one after the other",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: read_back,
    },
    Case {
        name: "timeline/threads",
        what: "four threads that submit to one queue, each with a semaphore of its own",
        oracle: "the same, one after the other",
        quantity: "words that differ",
        threshold: 0.0,
        full_only: false,
        measure: threads,
    },
];

const SPIRV: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/steps.spv"));

const SIZE: u32 = 64;
const WORKGROUPS: u32 = 16;
const COUNT: usize = (SIZE * WORKGROUPS) as usize;
const IN_FLIGHT: usize = 3;

fn kernel(lab: &Lab) -> Result<(PlainKernel, Vec<u32>), CheckError> {
    let mut constants = Specialization::default();
    constants.uint(WORKGROUP, SIZE);
    let mut kernel = PlainKernel::new(&lab.context, "steps", SPIRV, &constants, [COUNT, COUNT], IN_FLIGHT)?;
    let given: Vec<u32> = (0..COUNT as u32).map(|i| i.wrapping_mul(2_654_435_761)).collect();
    kernel.load(&given)?;
    Ok((kernel, given))
}

/// A step of all words; some are of another kind.
fn step(words: &mut [u32], given: &[u32], number: u32) {
    for (g, word) in words.iter_mut().enumerate() {
        let from = (g + number as usize) % given.len();
        *word = match number % 3 {
            0 => word.wrapping_mul(22_695_477).wrapping_add(number),
            _ => word.wrapping_mul(1_664_525).wrapping_add(given[from]).wrapping_add(number),
        };
    }
}

/// The same on the device.
fn record(r: &mut Recorder<'_>, kernel: (&crate::gpu::Pipeline, &crate::gpu::BindingSet), number: u32) {
    let push = [number, u32::from(number.is_multiple_of(3))];
    r.barrier(Access::Compute, Access::Compute);
    r.dispatch(kernel.0, kernel.1, bytemuck::bytes_of(&push), [WORKGROUPS, 1, 1]);
}

fn in_order(lab: &Lab, submissions: u32, dispatches: u32) -> Result<Measured, CheckError> {
    let (mut kernel, given) = kernel(lab)?;
    let found = sequence(&mut kernel, submissions, dispatches)?;
    let mut expected = vec![0; COUNT];
    (0..submissions * dispatches).for_each(|number| step(&mut expected, &given, number));
    let differ = lab.differing("words after all steps", &expected, &found);
    Ok(Measured::new(differ as f64, format!("{COUNT} words, {} dispatches", submissions * dispatches)))
}

/// Submits without waiting, but where the ring is full, and reads what is left.
fn sequence(kernel: &mut PlainKernel, submissions: u32, dispatches: u32) -> Result<Vec<u32>, CheckError> {
    let PlainKernel { timeline, pipeline, set, found, readback, .. } = kernel;
    for submission in 0..submissions {
        timeline.submit(|r| {
            (0..dispatches).for_each(|i| record(r, (pipeline, set), submission * dispatches + i));
        })?;
    }
    let ticket = timeline.submit(|r| {
        r.barrier(Access::Compute, Access::Transfer);
        r.copy(found, 0, readback, 0, found.bytes);
        r.barrier(Access::Transfer, Access::Host);
    })?;
    timeline.wait(&ticket)?;
    kernel.read(COUNT)
}

fn read_back(lab: &Lab) -> Result<Measured, CheckError> {
    const TURNS: u32 = 50;
    let (mut kernel, given) = kernel(lab)?;
    let mut expected = vec![0; COUNT];
    let mut differ = 0;
    for turn in 0..TURNS {
        let PlainKernel { timeline, pipeline, set, found, readback, .. } = &mut kernel;
        let ticket = timeline.submit(|r| {
            record(r, (pipeline, set), 2 * turn);
            r.barrier(Access::Compute, Access::Transfer);
            r.copy(found, 0, readback, 0, found.bytes);
            r.barrier(Access::Transfer, Access::Host);
        })?;
        // Under way while the host reads: it must not change what was copied.
        timeline.submit(|r| {
            r.barrier(Access::Transfer, Access::Compute);
            record(r, (pipeline, set), 2 * turn + 1);
        })?;
        timeline.wait(&ticket)?;
        step(&mut expected, &given, 2 * turn);
        differ += lab.differing(&format!("words after step {}", 2 * turn), &expected, &kernel.read(COUNT)?);
        step(&mut expected, &given, 2 * turn + 1);
        // The next copy writes where this one has been read.
        kernel.timeline.wait_all()?;
    }
    Ok(Measured::new(differ as f64, format!("{TURNS} times {COUNT} words")))
}

fn threads(lab: &Lab) -> Result<Measured, CheckError> {
    const THREADS: usize = 4;
    const SUBMISSIONS: u32 = 60;
    let results = std::thread::scope(|scope| {
        let run = || -> Result<(Vec<u32>, Vec<u32>), CheckError> {
            let (mut kernel, given) = kernel(lab)?;
            Ok((sequence(&mut kernel, SUBMISSIONS, 2)?, given))
        };
        let threads: Vec<_> = (0..THREADS).map(|_| scope.spawn(run)).collect();
        let join = |thread: std::thread::ScopedJoinHandle<'_, _>| {
            thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        threads.into_iter().map(join).collect::<Result<Vec<_>, _>>()
    })?;
    let mut differ = 0;
    for (found, given) in &results {
        let mut expected = vec![0; COUNT];
        (0..2 * SUBMISSIONS).for_each(|number| step(&mut expected, given, number));
        differ += lab.differing("words of a thread", &expected, found);
    }
    Ok(Measured::new(differ as f64, format!("{THREADS} threads, {} words", THREADS * COUNT)))
}
