//! Runs cases, some at a time, each on a thread of its own that may be given up.

use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::gpu::{Context, GpuError, Validation, Violation};
use crate::host::cpu_model;
use crate::render::{Accel, Mutation};

use crate::check::bundle::Bundle;
use crate::check::expectations::{Expectation, Expectations, Kind};
use crate::check::report::{CaseReport, DeviceReport, Verdict};
use crate::check::{Case, CheckError, Lab, Measured, cases, facts};

/// How long a case that runs may go on when all is to end.
const PATIENCE: Duration = Duration::from_secs(15);
/// How often it is looked whether all is to end.
const LOOK_AROUND: Duration = Duration::from_millis(200);
/// Of cases that did not come to their end for that.
const INTERRUPTED: &str = "interrupted";

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
    /// Once this is set, from another thread, no further case begins, and those that run have a little time to end.
    pub interrupted: Arc<AtomicBool>,
    /// How many times a case that fails is run again: if it passes then it is a flake.
    pub retries: u32,
    /// A folder for all that is known of cases that do not pass.
    pub bundle: Option<PathBuf>,
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
            retries: 0,
            bundle: None,
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
    let lab = |context: &Context| {
        let mut lab = Lab::new(context);
        (lab.full, lab.mutation, lab.accel) = (options.full, options.mutation, options.accel);
        lab
    };
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
        lanes: info.subgroup_size,
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
            let declared = expectations.of(lab.context.info(), case.name);
            let report = if options.interrupted.load(Ordering::Relaxed) {
                CaseReport { message: Some(INTERRUPTED.to_owned()), ..report_of(case, Verdict::NotRun) }
            } else if let Some(skipped) = declared.filter(|declared| declared.kind == Kind::Skip) {
                CaseReport { message: Some(skipped.reason.clone()), ..report_of(case, Verdict::Skipped) }
            } else if self.usable.load(Ordering::Relaxed) {
                run_case(case, lab, options, declared)
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

/// Runs a case, again if it fails and may, and writes down what is known of it if it does not pass.
fn run_case(case: &'static Case, lab: &Lab, options: &RunOptions, declared: Option<&Expectation>) -> CaseReport {
    let _ = (lab.context.take_capture(), lab.take_evidence());
    let mut report = measure(case, lab, options);
    let mut tries = 1;
    let is_settled = |report: &CaseReport| !matches!(report.verdict, Verdict::Fail | Verdict::Error);
    let first = report.clone();
    while declared.is_none() && !is_settled(&report) && tries <= options.retries {
        tries += 1;
        report = measure(case, lab, options);
    }
    if tries > 1 && report.verdict == Verdict::Pass {
        let why = first.message.unwrap_or_else(|| format!("measured {:e}", first.measured.unwrap_or(f64::NAN)));
        report.message = Some(format!("passes at try {tries}; the first: {why}"));
        report.verdict = Verdict::Flake;
    }
    if let Some(declared) = declared {
        judge(&mut report, declared);
    }
    let told =
        !matches!(report.verdict, Verdict::Pass | Verdict::NotRun | Verdict::NotSupported | Verdict::UnexpectedPass);
    if let (Some(folder), true) = (&options.bundle, told) {
        let (capture, evidence) = (lab.context.take_capture(), lab.take_evidence());
        let device = lab.context.info();
        let bundle = Bundle { device, case: &report, capture: &capture, evidence: &evidence, full: options.full };
        match bundle.write(folder) {
            Ok(place) => log::info!("{}: {}", case.name, place.display()),
            Err(error) => {
                log::error!("{}: what is known of {} cannot be written: {error}", folder.display(), case.name)
            }
        }
    }
    report
}

/// What was declared of a case changes what its result means.
fn judge(report: &mut CaseReport, declared: &Expectation) {
    let reason = &declared.reason;
    (report.verdict, report.message) = match (declared.kind, report.verdict) {
        (Kind::Fail, Verdict::Fail | Verdict::Error) => (Verdict::ExpectedFail, Some(reason.clone())),
        (Kind::Fail, Verdict::Pass) => {
            (Verdict::UnexpectedPass, Some(format!("passes, but is declared to fail: {reason}")))
        }
        (Kind::Flake, Verdict::Fail | Verdict::Error) => (Verdict::Flake, Some(reason.clone())),
        (_, verdict) => (verdict, report.message.take()),
    };
}

/// Runs a case once.
fn measure(case: &'static Case, lab: &Lab, options: &RunOptions) -> CaseReport {
    let start = Instant::now();
    let messages = lab.context.messages();
    let _ = messages.take();
    let result = with_timeout(case, lab, options);
    let mut report = report_of(case, Verdict::Error);
    report.seconds = start.elapsed().as_secs_f64();
    let heard = messages.take();
    match result {
        Some(Ok(measured)) => {
            report.verdict = if case.passes(&measured) { Verdict::Pass } else { Verdict::Fail };
            report.measured = Some(measured.value).filter(|v| v.is_finite());
            report.detail = measured.detail;
            if !measured.value.is_finite() {
                report.message = Some(format!("measured {}: {}", measured.value, report.detail));
            }
        }
        Some(Err(error)) => {
            report.verdict = match error.gpu() {
                Some(GpuError::DeviceLost(_)) => Verdict::DeviceLost,
                Some(GpuError::Timeout { .. }) => Verdict::Timeout,
                _ if error.is_lack() => Verdict::NotSupported,
                _ => Verdict::Error,
            };
            report.message = Some(error.to_string());
        }
        None => (report.verdict, report.message) = (Verdict::NotRun, Some(INTERRUPTED.to_owned())),
    }
    // Whatever was measured: a message is a failure, and no declaration excuses it.
    if let (Some(first), true) = (heard.first(), !matches!(report.verdict, Verdict::DeviceLost | Verdict::Timeout)) {
        report.verdict = Verdict::Validation;
        report.message = Some(format!("{} validation message(s); the first: {first}", heard.len()));
    }
    report
}

/// Runs on another thread. A case that takes too long, or that does not end when all is to end, keeps its thread, which ends with the
/// process; `None` in the second case.
fn with_timeout(case: &'static Case, lab: &Lab, options: &RunOptions) -> Option<Result<Measured, CheckError>> {
    let (sender, receiver) = mpsc::channel();
    let lab = lab.clone();
    let body = move || {
        // A lab is only read; what a panic leaves behind is dropped with it.
        let result = catch_unwind(AssertUnwindSafe(|| case.measure(&lab)));
        // Nobody listens any more after a timeout.
        let _ = sender.send(result.unwrap_or_else(|panic| Err(CheckError::Panic(panic_text(panic.as_ref())))));
    };
    let thread = match std::thread::Builder::new().name(case.name.to_owned()).spawn(body) {
        Ok(thread) => thread,
        Err(error) => return Some(Err(CheckError::Thread(error))),
    };
    let start = Instant::now();
    let mut interrupted: Option<Instant> = None;
    let result = loop {
        let left = options.timeout.saturating_sub(start.elapsed());
        match receiver.recv_timeout(left.min(LOOK_AROUND)) {
            Ok(result) => break result,
            // It ends without a word only if the thread is gone.
            Err(_) if left <= LOOK_AROUND => {
                return Some(Err(GpuError::Timeout { what: "a case", limit: options.timeout }.into()));
            }
            Err(_) => {}
        }
        if options.interrupted.load(Ordering::Relaxed)
            && interrupted.get_or_insert_with(Instant::now).elapsed() > PATIENCE
        {
            return None;
        }
    };
    // It still has a device to close: not while the process ends and unloads the driver.
    let _ = thread.join();
    Some(result)
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
    if context.validation() == Validation::GpuAssisted {
        context.violate(Violation::RayQuery)?;
    }
    let heard = context.messages().take();
    context.messages().put_back(before);
    Ok(heard)
}
