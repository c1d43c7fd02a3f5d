//! `photolith devices`.

use std::process::ExitCode;

use clap::Args;
use photolith::Context;
use serde_json::json;

use super::exit;

/// Arguments of `photolith devices`.
#[derive(Args)]
pub struct DevicesArgs {
    /// The device that would be asked for: index, UUID or part of the name
    #[arg(long, value_name = "INDEX|NAME|UUID")]
    device: Option<String>,

    /// Print one line of JSON on stdout
    #[arg(long)]
    json: bool,
}

/// Lists the devices; exit code 3 if none can be used.
pub fn run(args: &DevicesArgs) -> anyhow::Result<ExitCode> {
    let (devices, choice) = Context::devices(args.device.as_deref())?;
    if args.json {
        let list: Vec<_> = devices
            .iter()
            .map(|d| {
                json!({
                    "index": d.index, "name": d.name, "driver": d.driver, "kind": d.kind.to_string(),
                    "api_version": d.api_version, "uuid": d.uuid, "subgroup_size": d.subgroup_size,
                    "max_storage_range": d.max_storage_range, "max_texel_elements": d.max_texel_elements,
                    "memory": d.memory, "missing": d.missing,
                })
            })
            .collect();
        let picked = choice.as_ref().ok();
        println!(
            "{}",
            json!({ "schema": "photolith-devices-1", "devices": list, "picked": picked.map(|p| p.0),
                    "reason": picked.map(|p| p.1.clone()) })
        );
    } else {
        for d in &devices {
            println!("{}: {} ({})", d.index, d.name, d.kind);
            println!("   driver {}, Vulkan {}, subgroups of {}", d.driver, d.api_version, d.subgroup_size);
            println!(
                "   memory {}, storage buffers up to {}, texel buffers up to {} elements",
                bytes(d.memory),
                bytes(d.max_storage_range),
                d.max_texel_elements
            );
            println!("   UUID {}", d.uuid);
            if !d.missing.is_empty() {
                println!("   cannot be used: lacks {}", d.missing.join(", "));
            }
        }
        if let Ok((index, reason)) = &choice {
            println!("picked: {index}, {reason}");
        }
    }
    choice?;
    Ok(ExitCode::from(exit::OK))
}

/// A size for people.
pub fn bytes(n: u64) -> String {
    const UNITS: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    let mut value = n as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    if unit == 0 { format!("{n} B") } else { format!("{value:.1} {}", UNITS[unit]) }
}
