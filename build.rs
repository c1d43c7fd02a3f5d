//! Compiles every shaders/**/*.comp to SPIR-V with glslang (through shaderc).
//!
//! No optimiser runs: drivers optimise after specialization, and spirv-opt made lavapipe 22 17% slower.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

use shaderc::{
    CompileOptions, Compiler, EnvVersion, IncludeType, OptimizationLevel, ResolvedInclude, ShaderKind, SpirvVersion,
    TargetEnv,
};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=shaders");
    println!("cargo::rerun-if-changed=build.rs");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let compiler = Compiler::new()?;
    for source in entry_points(Path::new("shaders"))? {
        let text = fs::read_to_string(&source)?;
        let name = source.display().to_string();
        let stem = source.file_stem().and_then(|s| s.to_str()).ok_or("a shader's name is not UTF-8")?;
        for variant in variants(stem) {
            let mut options = options()?;
            for (macro_name, value) in &variant.macros {
                options.add_macro_definition(macro_name, Some(value));
            }
            let binary = compiler.compile_into_spirv(&text, ShaderKind::Compute, &name, "main", Some(&options))?;
            fs::write(out.join(format!("{stem}{}.spv", variant.suffix)), binary.as_binary_u8())?;
        }
    }
    Ok(())
}

/// A build of an entry point with its own macros; src/render/kernels.rs knows the suffixes.
struct Variant {
    suffix: String,
    macros: Vec<(&'static str, String)>,
}

/// The kernels of the path tracer are built for several numbers of constant spheres and facets, so that drivers need
/// not optimise code for places that a scene leaves empty.
fn variants(stem: &str) -> Vec<Variant> {
    // Trees: 0 none, 1 a tree, 2 a tree of which every leaf may be tested.
    let (steps, trees): (&[u32], &[u32]) = match stem {
        "path_trace" => (&[0, 1, 2], &[0, 1, 2]),
        "path_queue" => (&[0, 1, 2], &[1]),
        // Probes of rays: room for none or all.
        "closest" => (&[0, 2], &[1, 2]),
        "occlusion" | "scatter" | "traverse" => (&[0, 2], &[1]),
        _ => return vec![Variant { suffix: String::new(), macros: Vec::new() }],
    };
    let mut all = Vec::new();
    for spheres in steps.iter().map(|s| 8 * s) {
        for facets in steps.iter().map(|s| 16 * s) {
            for tree in trees {
                all.push(Variant {
                    suffix: format!("_s{spheres}_f{facets}_t{tree}"),
                    macros: vec![
                        ("MAX_SPHERES", spheres.to_string()),
                        ("MAX_FACETS", facets.to_string()),
                        ("WITH_TREE", tree.min(&1).to_string()),
                        ("WITH_BRUTE_FORCE", u32::from(*tree == 2).to_string()),
                    ],
                });
            }
        }
    }
    all
}

fn options() -> Result<CompileOptions<'static>, Box<dyn Error>> {
    let mut options = CompileOptions::new()?;
    options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_2 as u32);
    options.set_target_spirv(SpirvVersion::V1_5);
    options.set_optimization_level(OptimizationLevel::Zero);
    options.set_warnings_as_errors();
    options.set_include_callback(|requested, kind, from, _depth| {
        let base = match kind {
            IncludeType::Relative => Path::new(from).parent().unwrap_or(Path::new("")),
            IncludeType::Standard => Path::new("shaders"),
        };
        let path = base.join(requested);
        let content = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        Ok(ResolvedInclude { resolved_name: path.display().to_string(), content })
    });
    Ok(options)
}

fn entry_points(folder: &Path) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(entry_points(&path)?);
        } else if path.extension().is_some_and(|e| e == "comp") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}
