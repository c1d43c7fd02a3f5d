//! Compiles every shaders/**/*.comp to SPIR-V with glslang (through shaderc), and lists what it has made in kernels.rs.
//!
//! No optimiser runs: drivers optimise after specialization, and spirv-opt made lavapipe 22 17% slower.

#[path = "src/render/kernel/aliased.rs"]
mod aliased;
#[path = "src/spirv.rs"]
#[allow(dead_code)]
mod spirv;

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

use shaderc::{
    CompileOptions, Compiler, EnvVersion, IncludeType, OptimizationLevel, ResolvedInclude, ShaderKind, SpirvVersion,
    TargetEnv,
};

use aliased::declare_aliased;

fn main() -> Result<(), Box<dyn Error>> {
    for source in ["shaders", "build.rs", "src/render/kernel/aliased.rs", "src/spirv.rs"] {
        println!("cargo::rerun-if-changed={source}");
    }
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let compiler = Compiler::new()?;
    let options = options()?;
    let kernels = by_name(entry_points(Path::new("shaders"))?)?;
    for (kernel, source) in &kernels {
        let text = fs::read_to_string(source)?;
        let name = source.display().to_string();
        let binary = compiler.compile_into_spirv(&text, ShaderKind::Compute, &name, "main", Some(&options))?;
        let bytes: Vec<u8> = declare_aliased(binary.as_binary()).into_iter().flat_map(u32::to_le_bytes).collect();
        fs::write(out.join(kernel).with_extension("spv"), bytes)?;
    }
    fs::write(out.join("kernels.rs"), list(kernels.keys()))?;
    Ok(())
}

/// Shaders by the names of their files without folders, which the files that are made of them have too.
fn by_name(sources: Vec<PathBuf>) -> Result<BTreeMap<String, PathBuf>, Box<dyn Error>> {
    let mut kernels = BTreeMap::new();
    for source in sources {
        let name = source.file_stem().and_then(|s| s.to_str()).ok_or("a shader's name is not UTF-8")?.to_owned();
        if let Some(other) = kernels.insert(name, source.clone()) {
            return Err(format!("{} and {} have the same name", other.display(), source.display()).into());
        }
    }
    Ok(kernels)
}

/// An expression of Rust for all kernels: pairs of name and SPIR-V.
fn list<'a>(kernels: impl Iterator<Item = &'a String>) -> String {
    let pairs = kernels.map(|name| format!("(\"{name}\", &include_bytes!(\"{name}.spv\")[..]),\n"));
    format!("[\n{}]\n", pairs.collect::<String>())
}

fn options() -> Result<CompileOptions<'static>, Box<dyn Error>> {
    let mut options = CompileOptions::new()?;
    options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_2 as u32);
    options.set_target_spirv(SpirvVersion::V1_5);
    options.set_optimization_level(OptimizationLevel::Zero);
    options.set_warnings_as_errors();
    // What a device without ray queries gets of it, see src/gpu/prune.rs, has none.
    options.add_macro_definition("RAY_QUERY", None);
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
