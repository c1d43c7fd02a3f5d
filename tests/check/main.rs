//! The accuracy suite tested: it passes on the device at hand, and it has teeth.
//!
//! Every run has validation layers on; a message makes the case that caused it fail.

#[path = "../common/mod.rs"]
mod common;

use std::num::NonZeroUsize;
use std::sync::OnceLock;
use std::time::Duration;

use photolith::check::{
    CaseReport, CheckError, DeviceReport, Expectations, ExpectationsError, Lab, Report, RunOptions, Verdict, cases,
    held_by, junit, markdown, provoke_validation, run, written_expectations,
};
use photolith::render::Mutation;
use photolith::{Context, ContextOptions, Validation};

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
        &Expectations::built_in(context().info().driver_id).unwrap(),
    );
    // Only ray queries may be lacking.
    let is_lacking = |name: &str| lab_lacks_ray_queries() && name.starts_with("query/");
    let is_right = |case: &CaseReport| match case.verdict {
        Verdict::Pass | Verdict::ExpectedFail => true,
        Verdict::NotSupported => is_lacking(&case.name),
        _ => false,
    };
    let bad: Vec<_> = report.cases.iter().filter(|&c| !is_right(c)).collect();
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

/// By kind, wildcard, version and lanes.
#[test]
fn declarations_say_what_a_result_means() {
    let options = RunOptions { mutation: Some(Mutation::PlainSum), ..only(&["film/long-sum", "energy/black"]) };
    let lanes = context().info().subgroup_size;
    let verdicts = |fields: &str| {
        let declared = Expectations::parse(&format!("[[expected]]\nreason = \"known\"\n{fields}"), "test").unwrap();
        let report = suite(&options, &declared);
        let of = |name: &str| report.cases.iter().find(|c| c.name == name).unwrap().verdict;
        ([of("film/long-sum"), of("energy/black")], report.passes())
    };
    let undeclared = ([Verdict::Fail, Verdict::Pass], false);
    assert_eq!(verdicts("case = \"film/*\"\nkind = \"flake\""), ([Verdict::Flake, Verdict::Pass], true));
    assert_eq!(verdicts("case = \"*\"\nkind = \"skip\""), ([Verdict::Skipped; 2], true));
    assert_eq!(verdicts("case = \"film/long-su?\"\nversion = \"<1\""), undeclared);
    assert_eq!(verdicts(&format!("case = \"film/*\"\nlanes = {}", 2 * lanes)), undeclared);
    let here = format!("case = \"film/*\"\nversion = \">=1\"\nlanes = {lanes}");
    assert_eq!(verdicts(&here), ([Verdict::ExpectedFail, Verdict::Pass], true));
}

/// What a run writes down makes the next pass.
#[test]
fn written_expectations_are_met() {
    let options = RunOptions { mutation: Some(Mutation::PlainSum), retries: 1, ..only(&["film/long-sum"]) };
    let report = suite(&options, &Expectations::default());
    assert_eq!(report.cases[0].verdict, Verdict::Fail, "it fails again when it is run again");
    let text = written_expectations(&Report::new(vec![report]));
    let report = suite(&options, &Expectations::parse(&text, "written").unwrap());
    assert_eq!((report.cases[0].verdict, report.passes()), (Verdict::ExpectedFail, true), "{text}");
}

#[test]
fn a_case_that_fails_leaves_a_bundle() {
    let directory = tempfile::tempdir().unwrap();
    let folder = directory.path().join("bundles");
    let context = Context::new(&ContextOptions { capture: true, ..context_options(Validation::Core) }).unwrap();
    let options = RunOptions {
        mutation: Some(Mutation::BuiltInLog),
        bundle: Some(folder.clone()),
        ..only(&["sampling/log", "energy/black"])
    };
    // The second replaces what the first has left.
    for _ in 0..2 {
        let report = run(&context, &options, &Expectations::default(), |_| ()).unwrap();
        assert_eq!(report.count(Verdict::Fail), 1, "{report:#?}");
    }
    let names = |folder: &std::path::Path| -> Vec<String> {
        let mut names: Vec<_> =
            std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    assert_eq!(names(&folder), ["sampling-log"]);
    let bundle = folder.join("sampling-log");
    let readme = std::fs::read_to_string(bundle.join("README.md")).unwrap();
    assert!(readme.contains(&context.info().driver) && readme.contains("--filter sampling/log"), "{readme}");
    let files = names(&bundle);
    for name in files.iter().filter(|name| *name != "README.md" && !name.ends_with(".json")) {
        assert!(readme.contains(name.as_str()), "{name}: {readme}");
    }
    let shader = files.iter().find(|name| name.ends_with("functions.spv")).unwrap();
    let words: Vec<u32> = std::fs::read(bundle.join(shader))
        .unwrap()
        .chunks_exact(4)
        .map(|word| u32::from_le_bytes(word.try_into().unwrap()))
        .collect();
    assert_eq!(photolith::gpu::check_spirv(&words), Ok(()));
    assert!(files.iter().any(|name| name.contains("input")) && files.iter().any(|name| name.contains("output")));
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
    let is_heard = |validation, rule, object| {
        let context = Context::new(&context_options(validation)).unwrap();
        let heard = provoke_validation(&context).unwrap();
        assert_eq!(heard.len(), 1, "{heard:#?}");
        assert!(heard[0].contains(rule) && heard[0].contains(object), "{heard:#?}");
        assert!(context.messages().all().is_empty(), "the provoked messages are taken away again");
        context
    };
    let object = "deliberate violation";
    let context = is_heard(Validation::Core, "VUID-vkCmdFillBuffer-dstBuffer-00029", object);
    is_heard(Validation::Synchronization, "SYNC-HAZARD-WRITE-AFTER-WRITE", object);
    // Layers before about 1.4.300 do not look into ray queries.
    if context.check_ray_queries().is_ok() && context.validation_layer().is_some_and(|version| version >= (1, 4, 300)) {
        is_heard(Validation::GpuAssisted, "VUID-RuntimeSpirv-OpRayQueryInitializeKHR", object);
    }
    let silent = Context::new(&context_options(Validation::Off)).unwrap();
    assert!(provoke_validation(&silent).unwrap().is_empty());
}
