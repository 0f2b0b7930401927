//! Buffers, dispatches and reading back.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use bytemuck::Pod;
use wgpu::{BindingResource, Buffer, BufferUsages};

use crate::ldc::layout::Scan;
use crate::ldc::shaders::{Program, SCAN};
use crate::{Error, Gpu, Result};

/// Most workgroups along one side of a dispatch.
const SIDE: u64 = 65_535;

/// Numbers that a workgroup of `scan.wgsl` sums up.
const BLOCK: u64 = 1024;

/// Most texels in a row of the texture that holds those of all images.
const TEXELS: u64 = 4096;

/// Compiled entry points, by program and name.
#[derive(Debug, Default)]
pub(crate) struct Pipelines(Mutex<HashMap<(&'static str, &'static str), wgpu::ComputePipeline>>);

impl Gpu {
    /// A buffer of zeros that shaders read and write.
    pub(crate) fn storage(&self, what: &'static str, bytes: u64) -> Result<Buffer> {
        self.fits(what, bytes)?;
        self.scoped(what, || {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(what),
                size: bytes.next_multiple_of(4).max(16),
                usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        })
    }

    /// Whether a shader can have a buffer of this size.
    pub(crate) fn fits(&self, what: &'static str, bytes: u64) -> Result<()> {
        let limit = self.largest_binding();
        if bytes <= limit {
            return Ok(());
        }
        Err(Error::Limits {
            adapter: self.name(),
            what,
            needed: bytes,
            limit,
        })
    }

    /// Largest buffer that a shader can have, in bytes.
    pub(crate) fn largest_binding(&self) -> u64 {
        let limits = self.device.limits();
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
    }

    /// A buffer that shaders read, with these contents.
    pub(crate) fn uploaded<T: Pod>(&self, what: &'static str, contents: &[T]) -> Result<Buffer> {
        let buffer = self.storage(what, size_of_val(contents) as u64)?;
        self.scoped(what, || {
            self.queue
                .write_buffer(&buffer, 0, bytemuck::cast_slice(contents));
        })?;
        Ok(buffer)
    }

    /// Texels one after the other in the rows and layers of a texture that no device is too small for; one at least.
    pub(crate) fn texels(
        &self,
        what: &'static str,
        pieces: &[&[[u8; 4]]],
        count: u64,
    ) -> Result<wgpu::TextureView> {
        let limits = self.device.limits();
        let width = u64::from(limits.max_texture_dimension_2d).min(TEXELS);
        let rows = count.div_ceil(width).max(1);
        let layers = rows.div_ceil(width);
        if layers > u64::from(limits.max_texture_array_layers) || count > u64::from(u32::MAX) {
            return Err(Error::Limits {
                adapter: self.name(),
                what,
                needed: 4 * count,
                limit: 4 * u64::from(u32::MAX)
                    .min(width * width * u64::from(limits.max_texture_array_layers)),
            });
        }
        let height = rows.div_ceil(layers);
        let size = |width: u64, height: u64, layers: u64| wgpu::Extent3d {
            width: width as u32,
            height: height as u32,
            depth_or_array_layers: layers as u32,
        };
        let texture = self.scoped(what, || {
            self.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(what),
                size: size(width, height, layers),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba8Uint,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            })
        })?;
        // Whole layers, the last one filled up.
        let mut texels = pieces.iter().copied().flatten();
        for layer in 0..layers {
            let mut part: Vec<[u8; 4]> = texels.by_ref().take((width * height) as usize).copied().collect();
            part.resize((width * height) as usize, [0; 4]);
            self.scoped(what, || {
                let at = wgpu::TexelCopyTextureInfo {
                    texture: &texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d {
                        x: 0,
                        y: 0,
                        z: layer as u32,
                    },
                    aspect: wgpu::TextureAspect::All,
                };
                let layout = wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(4 * width as u32),
                    rows_per_image: Some(height as u32),
                };
                let part = bytemuck::cast_slice(&part);
                self.queue.write_texture(at, part, layout, size(width, height, 1));
            })?;
        }
        self.scoped(what, || {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..wgpu::TextureViewDescriptor::default()
            })
        })
    }

    /// Constants of a shader.
    pub(crate) fn uniform<T: Pod>(&self, what: &'static str, contents: &T) -> Result<Buffer> {
        self.scoped(what, || {
            let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(what),
                size: size_of::<T>() as u64,
                usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            self.queue.write_buffer(&buffer, 0, bytemuck::bytes_of(contents));
            buffer
        })
    }

    fn pipeline(&self, program: &Program, entry: &'static str) -> Result<wgpu::ComputePipeline> {
        let mut known = self.pipelines.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = known.get(&(program.name, entry)) {
            return Ok(pipeline.clone());
        }
        let pipeline = self.scoped(program.name, || {
            let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(program.name),
                source: wgpu::ShaderSource::Wgsl(program.source.into()),
            });
            self.device
                .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(entry),
                    layout: None,
                    module: &module,
                    entry_point: Some(entry),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    cache: None,
                })
        })?;
        known.insert((program.name, entry), pipeline.clone());
        Ok(pipeline)
    }

    /// Runs one entry point over at least `groups` workgroups and submits it.
    pub(crate) fn dispatch(
        &self,
        program: &Program,
        entry: &'static str,
        bindings: &[(u32, &Buffer)],
        groups: u64,
    ) -> Result<()> {
        let bindings: Vec<_> = bindings
            .iter()
            .map(|&(binding, buffer)| (binding, buffer.as_entire_binding()))
            .collect();
        self.dispatch_bound(program, entry, &bindings, groups)
    }

    /// The same with more than buffers.
    pub(crate) fn dispatch_bound(
        &self,
        program: &Program,
        entry: &'static str,
        bindings: &[(u32, BindingResource)],
        groups: u64,
    ) -> Result<()> {
        if groups == 0 {
            return Ok(());
        }
        let rows = groups.div_ceil(SIDE);
        if rows > SIDE {
            return Err(Error::Limits {
                adapter: self.name(),
                what: entry,
                needed: groups,
                limit: SIDE * SIDE,
            });
        }
        let pipeline = self.pipeline(program, entry)?;
        self.scoped(entry, || {
            let entries: Vec<_> = bindings
                .iter()
                .map(|(binding, resource)| wgpu::BindGroupEntry {
                    binding: *binding,
                    resource: resource.clone(),
                })
                .collect();
            let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(entry),
                layout: &pipeline.get_bind_group_layout(0),
                entries: &entries,
            });
            let mut encoder = self
                .device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(entry) });
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label: Some(entry),
                    timestamp_writes: None,
                });
                pass.set_pipeline(&pipeline);
                pass.set_bind_group(0, &group, &[]);
                pass.dispatch_workgroups(groups.div_ceil(rows) as u32, rows as u32, 1);
            }
            self.queue.submit([encoder.finish()]);
        })
    }

    /// Replaces numbers by the sums of those before each; returns the largest of them.
    pub(crate) fn scan(&self, values: &Buffer, count: u64) -> Result<u32> {
        let blocks = count.div_ceil(BLOCK);
        let constants = Scan {
            count: count as u32,
            blocks: blocks as u32,
            pad: [0; 2],
        };
        let scan = self.uniform("prefix sums", &constants)?;
        let sums = self.storage("prefix sums", 4 * blocks)?;
        let most = self.storage("prefix sums", 4)?;
        let run = |entry, bindings: &[(u32, &Buffer)], groups| self.dispatch(&SCAN, entry, bindings, groups);
        run(
            "reduce",
            &[(0, &scan), (1, values), (2, &sums), (3, &most)],
            blocks,
        )?;
        run("blocks", &[(0, &scan), (2, &sums)], 1)?;
        run("spread", &[(0, &scan), (1, values), (2, &sums)], blocks)?;
        Ok(self.read(&most, 0, 1)?[0])
    }

    /// Copies the first bytes of one buffer into another.
    pub(crate) fn copy(&self, from: &Buffer, to: &Buffer, bytes: u64) -> Result<()> {
        self.scoped("copy", || {
            let mut encoder = self
                .device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("copy") });
            encoder.copy_buffer_to_buffer(from, 0, to, 0, bytes);
            self.queue.submit([encoder.finish()]);
        })
    }

    /// Contents of a part of a buffer, once all that was submitted is done.
    pub(crate) fn read<T: Pod>(&self, buffer: &Buffer, first: u64, count: u64) -> Result<Vec<T>> {
        let size = size_of::<T>() as u64;
        if count == 0 {
            return Ok(Vec::new());
        }
        let staging = self.scoped("reading back", || {
            let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("reading back"),
                size: size * count,
                usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let mut encoder = self
                .device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                    label: Some("reading back"),
                });
            encoder.copy_buffer_to_buffer(buffer, size * first, &staging, 0, size * count);
            self.queue.submit([encoder.finish()]);
            staging.slice(..).map_async(wgpu::MapMode::Read, |_| ());
            staging
        })?;
        self.wait()?;
        // What could not be mapped has no range.
        let range = staging.slice(..).get_mapped_range().map_err(|e| Error::Lost {
            adapter: self.name(),
            problem: e.to_string(),
        })?;
        let contents = bytemuck::pod_collect_to_vec(&range);
        drop(range);
        staging.unmap();
        Ok(contents)
    }
}
