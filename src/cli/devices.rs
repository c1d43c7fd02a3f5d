//! `photolith devices`.

use std::fmt::Write as _;
use std::process::ExitCode;

use clap::Args;
use photolith::gpu::DeviceInfo;
use photolith::{Context, GpuError};
use serde_json::json;

use super::text::bytes;
use super::{exit, output};

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
    // Where there is no Vulkan at all, the list is empty.
    let found = Context::devices(args.device.as_deref());
    let (devices, choice) = found.unwrap_or_else(|error| (Vec::new(), Err(error)));
    let text = if args.json { format!("{}\n", as_json(&devices, &choice)) } else { as_text(&devices, &choice) };
    output::print(&text)?;
    choice?;
    Ok(ExitCode::from(exit::OK))
}

/// The index of the device that would be used, and why that one.
type Choice = Result<(usize, String), GpuError>;

fn as_json(devices: &[DeviceInfo], choice: &Choice) -> serde_json::Value {
    let list: Vec<_> = devices
        .iter()
        .map(|d| {
            json!({
                "index": d.index, "name": d.name, "driver": d.driver, "kind": d.kind.to_string(),
                "api_version": d.api_version, "uuid": d.uuid, "subgroup_size": d.subgroup_size,
                "max_storage_range": d.max_storage_range, "max_texel_elements": d.max_texel_elements,
                "max_query_primitives": d.ray_query.map(|limits| limits.max_primitives), "memory": d.memory,
                "missing": d.missing,
            })
        })
        .collect();
    let picked = choice.as_ref().ok();
    json!({ "schema": "photolith-devices-1", "devices": list, "picked": picked.map(|p| p.0),
            "reason": picked.map(|p| p.1.clone()) })
}

fn as_text(devices: &[DeviceInfo], choice: &Choice) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    for d in devices {
        let _ = writeln!(out, "{}: {} ({})", d.index, d.name, d.kind);
        let _ = writeln!(out, "   driver {}, Vulkan {}, subgroups of {}", d.driver, d.api_version, d.subgroup_size);
        let _ = writeln!(
            out,
            "   memory {}, storage buffers up to {}, texel buffers up to {} elements",
            bytes(d.memory),
            bytes(d.max_storage_range),
            d.max_texel_elements
        );
        let queries = match d.ray_query {
            Some(limits) => format!("ray queries in up to {} boxes or triangles", limits.max_primitives),
            None => "no ray queries".to_owned(),
        };
        let _ = writeln!(out, "   {queries}; UUID {}", d.uuid);
        if !d.missing.is_empty() {
            let _ = writeln!(out, "   cannot be used: lacks {}", d.missing.join(", "));
        }
    }
    if let Ok((index, reason)) = choice {
        let _ = writeln!(out, "picked: {index}, {reason}");
    }
    out
}
