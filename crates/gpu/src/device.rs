//! Adapters and the opened device.
//!
//! Only what every WebGPU device has is asked for: no optional features, the default limits (eight storage buffers a
//! stage, bindings of 128 MiB). So what runs on one device runs on all, and results do not depend on which it is but
//! by rounding. Every operation is run in error scopes; nothing waits longer than [`PATIENCE`].

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use wgpu::{Backends, ErrorFilter, PollType};

use crate::commands::Pipelines;
use crate::{Error, Result};

/// How long a batch of commands may take.
const PATIENCE: Duration = Duration::from_secs(300);

/// What there is to run on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterSummary {
    /// Name, as the driver tells it.
    pub name: String,
    /// `vulkan`, `metal` or `dx12`.
    pub backend: String,
    /// Name and version of the driver.
    pub driver: String,
    /// Whether it is the CPU in disguise.
    pub software: bool,
    /// Why it cannot be used.
    pub problem: Option<String>,
}

/// An opened device.
#[derive(Debug)]
pub struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    summary: AdapterSummary,
    /// What the driver said when the device was lost.
    lost: Arc<Mutex<Option<String>>>,
    pub(crate) pipelines: Pipelines,
}

fn instance() -> wgpu::Instance {
    let mut description = wgpu::InstanceDescriptor::new_without_display_handle();
    description.backends = Backends::VULKAN | Backends::METAL | Backends::DX12;
    wgpu::Instance::new(description)
}

fn enumerate() -> Vec<wgpu::Adapter> {
    pollster::block_on(instance().enumerate_adapters(Backends::all()))
}

fn summary(adapter: &wgpu::Adapter) -> AdapterSummary {
    let info = adapter.get_info();
    let driver = format!("{} {}", info.driver, info.driver_info);
    AdapterSummary {
        name: info.name,
        backend: info.backend.to_string(),
        driver: driver.trim().to_owned(),
        software: info.device_type == wgpu::DeviceType::Cpu,
        problem: shortfall(&wgpu::Limits::default(), &adapter.limits()),
    }
}

/// The first limit that an adapter does not reach.
fn shortfall(needed: &wgpu::Limits, has: &wgpu::Limits) -> Option<String> {
    let mut first = None;
    needed.check_limits_with_fail_fn(has, true, |name, needed, has| {
        first = Some(format!("{name} is {has}, {needed} is needed"));
    });
    first
}

/// All adapters, hardware first.
pub fn adapters() -> Vec<AdapterSummary> {
    let mut all: Vec<_> = enumerate().iter().map(summary).collect();
    all.sort_by_key(|a| (a.problem.is_some(), a.software));
    all
}

impl Gpu {
    /// Opens the first usable adapter whose name contains `name`, hardware before software.
    pub fn open(name: Option<&str>) -> Result<Self> {
        let mut found: Vec<_> = enumerate().into_iter().map(|a| (summary(&a), a)).collect();
        found.sort_by_key(|(s, _)| (s.problem.is_some(), s.software));
        let wanted = name.unwrap_or("").to_lowercase();
        let fits = |s: &AdapterSummary| s.problem.is_none() && s.name.to_lowercase().contains(&wanted);
        let Some(at) = found.iter().position(|(s, _)| fits(s)) else {
            return Err(no_adapter(name, found.iter().map(|(s, _)| s)));
        };
        let (summary, adapter) = found.swap_remove(at);
        let description = wgpu::DeviceDescriptor {
            label: Some("rayward"),
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&description)).map_err(|e| Error::Device {
                adapter: summary.name.clone(),
                problem: e.to_string(),
            })?;
        let lost = Arc::new(Mutex::new(None));
        let note = Arc::clone(&lost);
        device.set_device_lost_callback(move |_, message| {
            note.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .get_or_insert(message);
        });
        let note = Arc::clone(&lost);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            note.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .get_or_insert(error.to_string());
        }));
        Ok(Self {
            device,
            queue,
            summary,
            lost,
            pipelines: Pipelines::default(),
        })
    }

    /// What it runs on.
    pub fn adapter(&self) -> &AdapterSummary {
        &self.summary
    }

    pub(crate) fn name(&self) -> String {
        self.summary.name.clone()
    }

    fn check_lost(&self) -> Result<()> {
        let lost = self.lost.lock().unwrap_or_else(PoisonError::into_inner);
        match &*lost {
            Some(problem) => Err(Error::Lost {
                adapter: self.name(),
                problem: problem.clone(),
            }),
            None => Ok(()),
        }
    }

    /// Runs what makes buffers, shaders or commands, and turns what the device has against it into an error.
    pub(crate) fn scoped<T>(&self, what: &'static str, run: impl FnOnce() -> T) -> Result<T> {
        self.check_lost()?;
        let memory = self.device.push_error_scope(ErrorFilter::OutOfMemory);
        let internal = self.device.push_error_scope(ErrorFilter::Internal);
        let refused = self.device.push_error_scope(ErrorFilter::Validation);
        let made = run();
        let refused = pollster::block_on(refused.pop());
        let internal = pollster::block_on(internal.pop());
        let memory = pollster::block_on(memory.pop());
        self.check_lost()?;
        if memory.is_some() {
            return Err(Error::OutOfMemory {
                adapter: self.name(),
                what,
            });
        }
        match refused.or(internal) {
            Some(problem) => Err(Error::Shader {
                adapter: self.name(),
                what,
                problem: problem.to_string(),
            }),
            None => Ok(made),
        }
    }

    /// Waits until all that was submitted is done.
    pub(crate) fn wait(&self) -> Result<()> {
        let waited = self.device.poll(PollType::Wait {
            submission_index: None,
            timeout: Some(PATIENCE),
        });
        self.check_lost()?;
        match waited {
            Ok(_) => Ok(()),
            Err(problem) => Err(Error::Lost {
                adapter: self.name(),
                problem: problem.to_string(),
            }),
        }
    }

    /// Makes the device unusable, as a driver's reset does.
    pub fn destroy(&self) {
        self.lost
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get_or_insert_with(|| "it was closed".to_owned());
        self.device.destroy();
    }
}

fn no_adapter<'a>(name: Option<&str>, all: impl Iterator<Item = &'a AdapterSummary>) -> Error {
    let found: Vec<String> = all
        .map(|s| match &s.problem {
            Some(problem) => format!("{} ({problem})", s.name),
            None => s.name.clone(),
        })
        .collect();
    Error::NoAdapter {
        wanted: name.map_or("that can be used".to_owned(), |n| format!("called \"{n}\"")),
        found: if found.is_empty() {
            "none was found".to_owned()
        } else {
            format!("there is {}", found.join(", "))
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_told() {
        let needed = wgpu::Limits::default();
        assert_eq!(shortfall(&needed, &needed), None);
        let small = wgpu::Limits {
            max_storage_buffers_per_shader_stage: 4,
            ..needed.clone()
        };
        let problem = shortfall(&needed, &small).unwrap_or_default();
        assert!(
            problem.contains("max_storage_buffers_per_shader_stage") && problem.contains('8'),
            "{problem}"
        );
        let error = no_adapter(
            None,
            [AdapterSummary {
                name: "Old card".to_owned(),
                backend: "vulkan".to_owned(),
                driver: String::new(),
                software: false,
                problem: Some(problem),
            }]
            .iter(),
        );
        let text = error.to_string();
        assert!(text.contains("Old card (max_storage"), "{text}");
        let none = no_adapter(Some("Voodoo"), [].iter()).to_string();
        assert!(none.contains("Voodoo") && none.contains("Mesa"), "{none}");
    }
}
