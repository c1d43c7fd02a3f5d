//! The accuracy suite tested: it passes on the device at hand, and it has teeth.
//!
//! Every run has validation layers on; a message makes the case that caused it fail.

#[path = "../common/mod.rs"]
mod common;

use std::num::NonZeroUsize;
use std::sync::OnceLock;
use std::time::Duration;

use photolith::check::{
    CheckError, DeviceReport, Expectations, ExpectationsError, Lab, Report, RunOptions, Verdict, cases, held_by, junit,
    markdown, provoke_validation, run,
};
use photolith::render::Mutation;
use photolith::{Context, Validation};

use common::context_options;

fn context() -> Context {
    static SHARED: OnceLock<Context> = OnceLock::new();
    SHARED.get_or_init(|| Context::new(&context_options(Validation::Core)).unwrap()).clone()
}

/// One at a time: the validation messages of a context are told apart by when they come.
fn suite(options: &RunOptions, expectations: &Expectations) -> DeviceReport {
    static TURN: std::sync::Mutex<()> = std::sync::Mutex::new(());
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    run(&context(), options, expectations, |_| ()).unwrap()
}

fn only(names: &[&str]) -> RunOptions {
    RunOptions { filter: names.iter().map(|n| (*n).to_owned()).collect(), ..RunOptions::default() }
}

#[test]
fn the_quick_suite_passes_under_validation() {
    let jobs = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let report = suite(
        &RunOptions { jobs, timeout: Duration::from_secs(600), ..RunOptions::default() },
        &Expectations::default(),
    );
    // Only ray queries may be lacking.
    let is_lacking = |name: &str| lab_lacks_ray_queries() && name.starts_with("query/");
    let expected = |name: &str| if is_lacking(name) { Verdict::NotSupported } else { Verdict::Pass };
    let bad: Vec<_> = report.cases.iter().filter(|c| c.verdict != expected(&c.name)).collect();
    assert!(bad.is_empty(), "{bad:#?}");
    assert!(report.validation && report.passes());
    assert_eq!(report.cases.len(), cases().filter(|case| !case.full_only).count());
}

/// Deliberate errors, each with the case that does not notice it.
fn unnoticed(mutations: impl Iterator<Item = Mutation>) -> Vec<String> {
    let lab = Lab::new(&context());
    let mut unnoticed = Vec::new();
    for mutation in mutations {
        let names = held_by(mutation);
        assert!(!names.is_empty(), "{mutation:?}");
        for name in names {
            let case = cases().find(|c| c.name == *name).unwrap_or_else(|| panic!("no case {name}"));
            let mut broken = lab.clone();
            broken.mutation = Some(mutation);
            let measured = match case.measure(&broken) {
                Err(CheckError::NotSupported(_)) if lab_lacks_ray_queries() => continue,
                measured => measured.unwrap(),
            };
            if case.passes(&measured) {
                unnoticed.push(format!("{name} does not notice {mutation:?}: {measured:?}"));
            }
        }
    }
    unnoticed
}

fn lab_lacks_ray_queries() -> bool {
    context().info().ray_query.is_none()
}

fn is_of_ray_queries(mutation: &Mutation) -> bool {
    held_by(*mutation).iter().any(|name| name.starts_with("query/"))
}

#[test]
fn every_mutation_makes_its_cases_fail() {
    let unnoticed = unnoticed(Mutation::ALL.into_iter().filter(|m| !is_of_ray_queries(m)));
    assert!(unnoticed.is_empty(), "{unnoticed:#?}");
}

/// Where the device has some.
#[test]
fn mutations_of_ray_queries_make_their_cases_fail() {
    let unnoticed = unnoticed(Mutation::ALL.into_iter().filter(is_of_ray_queries));
    assert!(unnoticed.is_empty(), "{unnoticed:#?}");
}

#[test]
fn names_are_unique_and_sizes_are_sane() {
    let names: Vec<_> = cases().map(|c| c.name).collect();
    for (i, name) in names.iter().enumerate() {
        assert!(!names[..i].contains(name), "{name} twice");
        assert!(name.split('/').count() == 2, "{name}");
    }
    assert!(cases().all(|c| c.threshold >= 0.0 && c.threshold.is_finite()));
}

#[test]
fn declared_failures_are_expected_and_declared_passes_are_not() {
    let options = RunOptions { mutation: Some(Mutation::PlainSum), ..only(&["film/long-sum", "energy/black"]) };
    let declare = |driver: &str, case: &str| {
        Expectations::parse(
            &format!("[[expected]]\ndriver = \"{driver}\"\ncase = \"{case}\"\nreason = \"known\""),
            "test",
        )
        .unwrap()
    };
    let driver = context().info().driver.clone();
    let verdicts = |e: &Expectations| {
        let report = suite(&options, e);
        (report.cases.iter().map(|c| (c.name.clone(), c.verdict)).collect::<Vec<_>>(), report.passes())
    };
    let of = |list: &[(String, Verdict)], name: &str| list.iter().find(|v| v.0 == name).unwrap().1;

    let (undeclared, passes) = verdicts(&Expectations::default());
    assert_eq!((of(&undeclared, "film/long-sum"), passes), (Verdict::Fail, false));
    let (declared, passes) = verdicts(&declare(&driver.to_uppercase(), "film/long-sum"));
    assert_eq!((of(&declared, "film/long-sum"), passes), (Verdict::ExpectedFail, true));
    let (other_driver, passes) = verdicts(&declare("another driver", "film/long-sum"));
    assert_eq!((of(&other_driver, "film/long-sum"), passes), (Verdict::Fail, false));
    let (stale, passes) = verdicts(&declare(&driver, "energy/black"));
    assert_eq!((of(&stale, "energy/black"), passes), (Verdict::UnexpectedPass, false));
}

#[test]
fn bad_expectation_files_are_refused() {
    let parse = |text: &str| Expectations::parse(text, "file.toml").unwrap_err();
    let unknown = parse("[[expected]]\ndriver = \"x\"\ncase = \"no/case\"\nreason = \"y\"");
    assert!(matches!(&unknown, ExpectationsError::NoSuchCase { case, .. } if case == "no/case"));
    assert!(unknown.to_string().contains("file.toml"));
    assert!(matches!(parse("[[expected]]\ndriver = \"x\""), ExpectationsError::Syntax { .. }));
    assert!(matches!(parse("[[expekted]]"), ExpectationsError::Syntax { .. }));
    assert!(matches!(
        parse("[[expected]]\ndriver = \"x\"\ncase = \"energy/black\"\nversion = \"new\"\nreason = \"y\""),
        ExpectationsError::Syntax { .. }
    ));
    let empty = parse("[[expected]]\ndriver = \" \"\ncase = \"energy/black\"\nreason = \"y\"");
    assert!(matches!(empty, ExpectationsError::Empty { field: "driver", .. }));
    assert!(Expectations::parse("", "empty").is_ok());
    assert!(matches!(Expectations::load("no-such-file.toml".as_ref()), Err(ExpectationsError::Read { .. })));
}

#[test]
fn reports_are_well_formed() {
    let report = suite(&only(&["energy/black", "sampling/log"]), &Expectations::default());
    assert_eq!(report.cases.len(), 2);
    let report = Report::new(vec![report]);
    let json = serde_json::to_string(&report).unwrap();
    let back: Report = serde_json::from_str(&json).unwrap();
    assert_eq!(back.devices[0].cases.len(), 2);
    assert_eq!(back.schema, "photolith-check-1");

    let xml = junit(&report);
    assert_eq!(xml.matches("<testcase ").count(), 2);
    assert!(xml.contains("tests=\"2\" failures=\"0\" errors=\"0\" skipped=\"0\""), "{xml}");
    assert!(xml.ends_with("</testsuites>\n"));

    // Two drivers side by side.
    let mut other = report.clone();
    other.devices[0].driver = "another".to_owned();
    let page = markdown(&[report.clone(), other]);
    let row = page.lines().find(|l| l.starts_with("| `energy/black`")).unwrap();
    let head = page.lines().find(|l| l.starts_with("| case | what")).unwrap();
    assert_eq!(row.matches(" | ").count(), head.matches(" | ").count(), "{row}");
    assert!(head.ends_with("| A | B |"), "{head}");

    // Two runs of one driver.
    let split = |keep: &str| {
        let mut part = report.clone();
        part.devices[0].cases.retain(|c| c.name == keep);
        part
    };
    let page = markdown(&[split("energy/black"), split("sampling/log")]);
    let head = page.lines().find(|l| l.starts_with("| case | what")).unwrap();
    assert!(head.ends_with("| threshold | A |"), "{head}");
    assert!(page.contains("2 of 2 pass") && page.find("`sampling/log`") < page.find("`energy/black`"), "{page}");
}

#[test]
fn a_case_that_takes_too_long_is_given_up() {
    let options = RunOptions { timeout: Duration::from_micros(1), ..only(&["energy/black", "sampling/log"]) };
    // A context of its own: the case goes on in the background.
    let context = Context::new(&context_options(Validation::Off)).unwrap();
    let report = run(&context, &options, &Expectations::default(), |_| ()).unwrap();
    let verdicts: Vec<_> = report.cases.iter().map(|c| c.verdict).collect();
    assert_eq!(verdicts, [Verdict::Timeout, Verdict::NotRun]);
}

#[test]
fn jobs_side_by_side_give_the_same_report() {
    let names = ["sampling/error-free", "energy/black", "sampling/log", "glass/fresnel-grazing", "sampling/basis"];
    let report = |jobs| {
        let options = RunOptions { jobs: NonZeroUsize::new(jobs).unwrap(), ..only(&names) };
        let mut told = Vec::new();
        let context = context().reopen().unwrap();
        let mut report = run(&context, &options, &Expectations::default(), |c| told.push(c.name.clone())).unwrap();
        assert!(report.passes() && report.validation, "{report:#?}");
        told.sort_unstable();
        (report.cases.iter_mut().for_each(|c| c.seconds = 0.0), report.cases, told)
    };
    let (_, alone, told) = report(1);
    assert_eq!((alone.len(), told.len()), (5, 5));
    assert_eq!(report(3), ((), alone.clone(), told.clone()));
    // More jobs than cases.
    assert_eq!(report(9), ((), alone, told));
}

/// Each kind of validation hears the violation that is for it, once, and calls the object by its debug name.
#[test]
fn deliberate_violations_are_heard() {
    for (validation, rule) in [
        (Validation::Core, "VUID-vkCmdFillBuffer-dstBuffer-00029"),
        (Validation::Synchronization, "SYNC-HAZARD-WRITE-AFTER-WRITE"),
    ] {
        let context = Context::new(&context_options(validation)).unwrap();
        let heard = provoke_validation(&context).unwrap();
        assert_eq!(heard.len(), 1, "{heard:#?}");
        assert!(heard[0].contains(rule) && heard[0].contains("deliberate violation"), "{heard:#?}");
        assert!(context.messages().all().is_empty(), "the provoked messages are taken away again");
    }
    let silent = Context::new(&context_options(Validation::Off)).unwrap();
    assert!(provoke_validation(&silent).unwrap().is_empty());
}
