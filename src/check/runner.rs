//! Runs cases, some at a time, each on a thread of its own that may be given up.

use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::gpu::{Context, GpuError, Validation, Violation};
use crate::host::cpu_model;
use crate::render::{Accel, Mutation};

use crate::check::expectations::Expectations;
use crate::check::report::{CaseReport, DeviceReport, Verdict};
use crate::check::{Case, CheckError, Lab, Measured, cases, facts};

/// How to run the suite.
#[derive(Debug, Clone)]
pub struct RunOptions {
    /// Full sizes.
    pub full: bool,
    /// Only cases whose name contains one of these; all if empty.
    pub filter: Vec<String>,
    /// How long a case may take.
    pub timeout: Duration,
    /// Break one thing, to see which cases notice.
    pub mutation: Option<Mutation>,
    /// How triangles are found, where a case does not decide that itself.
    pub accel: Accel,
    /// Cases at a time, each on a device of its own: what a validation layer says is known to be said of one case.
    pub jobs: NonZeroUsize,
    /// Once this is set, from another thread, no further case begins.
    pub interrupted: Arc<AtomicBool>,
}

impl Default for RunOptions {
    fn default() -> Self {
        Self {
            full: false,
            filter: Vec::new(),
            timeout: Duration::from_secs(120),
            mutation: None,
            accel: Accel::default(),
            jobs: NonZeroUsize::MIN,
            interrupted: Arc::default(),
        }
    }
}

impl RunOptions {
    /// The cases that are to run.
    pub fn selected(&self) -> Vec<&'static Case> {
        let wanted = |name: &str| self.filter.is_empty() || self.filter.iter().any(|f| name.contains(f.as_str()));
        cases().filter(|c| wanted(c.name) && (self.full || !c.full_only)).collect()
    }
}

/// Runs the selected cases on a device. `on_case` is told of each when it is over; the report has them in their order.
///
/// A lost device, a case that does not end, or [`RunOptions::interrupted`] ends the run: cases that had not begun are reported
/// as not run.
///
/// # Errors
/// The facts of the driver's arithmetic cannot be probed, or the device cannot be opened once more for another job. What
/// goes wrong in a case is in its report.
pub fn run(
    context: &Context,
    options: &RunOptions,
    expectations: &Expectations,
    on_case: impl FnMut(&CaseReport) + Send,
) -> Result<DeviceReport, CheckError> {
    let start = Instant::now();
    let started = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let RunOptions { full, mutation, accel, .. } = *options;
    let lab = |context: &Context| Lab { context: context.clone(), full, mutation, accel };
    let facts = facts(&lab(context))?;
    let cases = options.selected();
    let mut labs = vec![lab(context)];
    while labs.len() < options.jobs.get().min(cases.len()) {
        labs.push(lab(&context.reopen()?));
    }
    let queue = Queue {
        cases: &cases,
        next: AtomicUsize::new(0),
        usable: AtomicBool::new(true),
        done: Mutex::new((vec![None; cases.len()], on_case)),
    };
    std::thread::scope(|scope| {
        let queue = &queue;
        for lab in &labs {
            scope.spawn(move || queue.work(lab, options, expectations));
        }
    });
    let (reports, _) = queue.done.into_inner().unwrap_or_else(PoisonError::into_inner);
    let info = context.info();
    Ok(DeviceReport {
        device: info.name.clone(),
        driver: info.driver.clone(),
        kind: info.kind.to_string(),
        api_version: info.api_version.clone(),
        host_cpu: host_cpu(),
        full: options.full,
        validation: context.validation() != Validation::Off,
        facts,
        cases: reports.into_iter().flatten().collect(),
        started,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Cases that jobs take in turn.
struct Queue<'a, F> {
    cases: &'a [&'static Case],
    next: AtomicUsize,
    usable: AtomicBool,
    /// Reports by the number of their case, and who is told.
    done: Mutex<(Vec<Option<CaseReport>>, F)>,
}

impl<F: FnMut(&CaseReport)> Queue<'_, F> {
    /// Runs cases until none is left.
    fn work(&self, lab: &Lab, options: &RunOptions, expectations: &Expectations) {
        loop {
            let index = self.next.fetch_add(1, Ordering::Relaxed);
            let Some(&case) = self.cases.get(index) else { return };
            let report = if options.interrupted.load(Ordering::Relaxed) {
                CaseReport { message: Some("interrupted".to_owned()), ..report_of(case, Verdict::NotRun) }
            } else if self.usable.load(Ordering::Relaxed) {
                run_case(case, lab, options, expectations)
            } else {
                report_of(case, Verdict::NotRun)
            };
            if matches!(report.verdict, Verdict::DeviceLost | Verdict::Timeout) {
                self.usable.store(false, Ordering::Relaxed);
            }
            let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
            let (reports, on_case) = &mut *done;
            on_case(&report);
            reports[index] = Some(report);
        }
    }
}

fn report_of(case: &Case, verdict: Verdict) -> CaseReport {
    CaseReport {
        name: case.name.to_owned(),
        what: case.what.to_owned(),
        oracle: case.oracle.to_owned(),
        quantity: case.quantity.to_owned(),
        threshold: case.threshold,
        measured: None,
        detail: String::new(),
        seconds: 0.0,
        verdict,
        message: None,
    }
}

fn run_case(case: &'static Case, lab: &Lab, options: &RunOptions, expectations: &Expectations) -> CaseReport {
    let start = Instant::now();
    let messages = lab.context.messages();
    let _ = messages.take();
    let result = with_timeout(case, lab, options.timeout);
    let mut report = report_of(case, Verdict::Error);
    report.seconds = start.elapsed().as_secs_f64();
    let heard = messages.take();
    match result {
        Ok(measured) => {
            report.verdict = if case.passes(&measured) { Verdict::Pass } else { Verdict::Fail };
            report.measured = Some(measured.value).filter(|v| v.is_finite());
            report.detail = measured.detail;
            if !measured.value.is_finite() {
                report.message = Some(format!("measured {}: {}", measured.value, report.detail));
            }
        }
        Err(error) => {
            report.verdict = match error.gpu() {
                Some(GpuError::DeviceLost(_)) => Verdict::DeviceLost,
                Some(GpuError::Timeout { .. }) => Verdict::Timeout,
                _ if matches!(error, CheckError::NotSupported(_)) => Verdict::NotSupported,
                _ => Verdict::Error,
            };
            report.message = Some(error.to_string());
        }
    }
    if let Some(declared) = expectations.of(&lab.context.info().driver, case.name) {
        match report.verdict {
            Verdict::Fail => (report.verdict, report.message) = (Verdict::ExpectedFail, Some(declared.reason.clone())),
            Verdict::Pass => {
                report.verdict = Verdict::UnexpectedPass;
                report.message = Some(format!("passes, but is declared to fail: {}", declared.reason));
            }
            _ => {}
        }
    }
    // Whatever was measured: a message is a failure, and no declaration excuses it.
    if let (Some(first), true) = (heard.first(), !matches!(report.verdict, Verdict::DeviceLost | Verdict::Timeout)) {
        report.verdict = Verdict::Validation;
        report.message = Some(format!("{} validation message(s); the first: {first}", heard.len()));
    }
    report
}

/// Runs on another thread. A case that takes too long keeps its thread, which ends with the process.
fn with_timeout(case: &'static Case, lab: &Lab, timeout: Duration) -> Result<Measured, CheckError> {
    let (sender, receiver) = mpsc::channel();
    let lab = lab.clone();
    let body = move || {
        // A lab is only read; what a panic leaves behind is dropped with it.
        let result = catch_unwind(AssertUnwindSafe(|| case.measure(&lab)));
        // Nobody listens any more after a timeout.
        let _ = sender.send(result.unwrap_or_else(|panic| Err(CheckError::Panic(panic_text(panic.as_ref())))));
    };
    let thread = std::thread::Builder::new().name(case.name.to_owned()).spawn(body).map_err(CheckError::Thread)?;
    let Ok(result) = receiver.recv_timeout(timeout) else {
        return Err(GpuError::Timeout { what: "a case", limit: timeout }.into());
    };
    // It still has a device to close: not while the process ends and unloads the driver.
    let _ = thread.join();
    result
}

fn panic_text(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("without a message").to_owned()
}

fn host_cpu() -> String {
    cpu_model().unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

/// Breaks rules of Vulkan on purpose. Returns the messages that this gave and removes them: none means that validation
/// is deaf.
///
/// # Errors
/// A Vulkan call fails.
pub fn provoke_validation(context: &Context) -> Result<Vec<String>, GpuError> {
    let before = context.messages().take();
    context.violate(Violation::Usage)?;
    context.violate(Violation::Hazard)?;
    let heard = context.messages().take();
    context.messages().put_back(before);
    Ok(heard)
}
