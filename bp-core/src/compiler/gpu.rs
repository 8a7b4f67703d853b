//! Kernels on a graphics processor, by WebGPU and the shaders of [`crate::emit::wgsl`].
//!
//! In: a kernel and its inputs, in f32. Out: its outputs. Invariant: inputs are checked as by the other back ends;
//! without an adapter there is no [`Gpu`], and nothing else fails.
//!
//! Needs the feature `gpu`. A software adapter, such as Mesa's, is sufficient.

use crate::emit::wgsl::{MOST_WORKGROUPS, Shader, WORKGROUP, emit_wgsl};
use crate::error::Error;
use crate::exec::{Array, Bound, Inputs, Outputs};
use crate::ids::BufferId;
use crate::kernel::{Kernel, OutputKey, Role};
use crate::radix;
use std::sync::{Arc, Mutex};
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BufferUsages, ShaderStages};

/// A device that runs kernels.
#[derive(Debug)]
pub struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    name: String,
    /// Limit of the bytes of one buffer.
    most: u64,
}

/// A kernel prepared for repeated runs on a device.
#[derive(Debug)]
pub struct GpuKernel<'g> {
    gpu: &'g Gpu,
    kernel: Kernel,
    /// The pipelines of the last run, compiled for its extents.
    ready: Mutex<Option<Arc<Pipelines>>>,
}

/// A shader for given extents, compiled.
#[derive(Debug)]
struct Pipelines {
    extents: Vec<usize>,
    shader: Shader,
    bindings: wgpu::BindGroupLayout,
    pipelines: Vec<wgpu::ComputePipeline>,
}

/// A kernel whose inputs are on the device.
#[derive(Debug)]
pub struct GpuRun<'g> {
    gpu: &'g Gpu,
    ready: Arc<Pipelines>,
    numbers: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    /// Workgroups of each pass.
    groups: Vec<(u32, u32)>,
    /// Name, first number and count of each output.
    outputs: Vec<(OutputKey, u64, u64)>,
}

/// The data sent to the device.
#[derive(Default)]
struct Upload {
    numbers: Vec<f32>,
    positions: Vec<i32>,
    /// Name, first number and count of each output.
    outputs: Vec<(OutputKey, u64, u64)>,
}

impl Gpu {
    /// The most powerful device of this machine; `None` if it has none.
    pub fn open() -> Option<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options)).ok()?;
        let limits = adapter.limits();
        let wanted = wgpu::DeviceDescriptor { required_limits: limits.clone(), ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&wanted)).ok()?;
        let most = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size);
        Some(Self { device, queue, name: adapter.get_info().name, most })
    }

    /// The name of the device.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// A kernel for this device; it is compiled once its extents are known.
    pub fn prepare(&self, kernel: Kernel) -> GpuKernel<'_> {
        GpuKernel { gpu: self, kernel, ready: Mutex::default() }
    }

    fn compile(&self, kernel: &Kernel, extents: Vec<usize>) -> Result<Pipelines, Error> {
        let shader = emit_wgsl(kernel)?;
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(&kernel.name),
            source: wgpu::ShaderSource::Wgsl(shader.text.as_str().into()),
        });
        let entry = |binding: u32, read_only: bool| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let bindings = self.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[entry(0, false), entry(1, true), entry(2, true)],
        });
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            bind_group_layouts: &[Some(&bindings)],
            ..Default::default()
        });
        let pipelines = shader.passes.iter().map(|pass| {
            self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(&pass.entry),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(&pass.entry),
                compilation_options: Default::default(),
                cache: None,
            })
        });
        let pipelines = pipelines.collect();
        Ok(Pipelines { extents, shader, bindings, pipelines })
    }
}

impl<'g> GpuKernel<'g> {
    /// Runs the kernel once.
    ///
    /// # Errors
    /// An input that is missing or invalid; arrays that are too large for the device.
    pub fn run(&self, inputs: &Inputs<'_, f32>) -> Result<Outputs<f32>, Error> {
        let run = self.load(inputs)?;
        run.dispatch();
        Ok(run.outputs())
    }

    /// Copies the inputs to the device, and compiles the kernel for their extents unless the last ones were the same.
    ///
    /// # Errors
    /// As [`GpuKernel::run`].
    pub fn load(&self, inputs: &Inputs<'_, f32>) -> Result<GpuRun<'g>, Error> {
        let bound = inputs.bind(&self.kernel)?;
        let ready = self.ready(inputs, &bound)?;
        let Upload { numbers, positions, outputs } = upload(&ready.shader, &bound);
        let cells = numbers.len() as f64;
        if 4.0 * cells > self.gpu.most as f64 {
            let help = format!("`{}` takes no larger arrays; ask a smaller question", self.gpu.name);
            let most = self.gpu.most as f64 / 4.0;
            return Err(Error::TooLarge { name: self.kernel.name.clone(), cells, most, help });
        }
        let buffer = |bytes: Vec<u8>| {
            let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
            self.gpu.device.create_buffer_init(&BufferInitDescriptor { label: None, contents: &bytes, usage })
        };
        let numbers = buffer(numbers.into_iter().flat_map(f32::to_le_bytes).collect());
        let positions = buffer(positions.into_iter().flat_map(i32::to_le_bytes).collect());
        let shape = buffer(f32::INFINITY.to_le_bytes().into());
        let bindings = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &ready.bindings,
            entries: &[&numbers, &positions, &shape]
                .map(wgpu::Buffer::as_entire_binding)
                .into_iter()
                .enumerate()
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding: binding as u32, resource })
                .collect::<Vec<_>>(),
        });
        let groups = ready.shader.passes.iter().map(|pass| {
            let cells: usize = pass.axes.iter().map(|axis| bound.extent(*axis)).product();
            let groups = (cells as u32).div_ceil(WORKGROUP);
            (groups.min(MOST_WORKGROUPS), groups.div_ceil(MOST_WORKGROUPS))
        });
        let groups = groups.collect();
        Ok(GpuRun { gpu: self.gpu, ready, numbers, bindings, groups, outputs })
    }

    /// The pipelines for these extents.
    fn ready(&self, inputs: &Inputs<'_, f32>, bound: &Bound<'_, f32>) -> Result<Arc<Pipelines>, Error> {
        let extents: Vec<usize> = self.kernel.axes.ids().map(|axis| bound.extent(axis)).collect();
        let mut last = self.ready.lock().expect("internal: no thread fails while it compiles");
        match &*last {
            Some(ready) if ready.extents == extents => Ok(ready.clone()),
            _ => {
                let default = |name: &str| {
                    let mut sizes = self.kernel.sizes.iter();
                    sizes.find(|size| size.name == name).and_then(|size| size.default)
                };
                let size = |name: &str| inputs.find_size(name).or_else(|| default(name));
                let ready = Arc::new(self.gpu.compile(&self.kernel.with_sizes(size)?, extents)?);
                *last = Some(ready.clone());
                Ok(ready)
            }
        }
    }
}

/// The arrays that a shader reads, each whole, one after the other.
fn upload(shader: &Shader, bound: &Bound<'_, f32>) -> Upload {
    let mut upload = Upload::default();
    for (id, buffer) in bound.kernel.buffers.iter().filter(|(id, _)| shader.layout.is_stored(*id)) {
        let (numbers, count) = (&mut upload.numbers, bound.length(id));
        let first = numbers.len();
        match &bound.arrays[id] {
            Array::Given(cells) | Array::Owned(cells) => numbers.extend_from_slice(cells),
            Array::Default => numbers.resize(first + count, bound.default(id) as f32),
            Array::Broadcast(cells) => numbers.extend(spread(bound, id, cells)),
            Array::Positions(cells) => upload.positions.extend_from_slice(cells),
            Array::Made => numbers.resize(first + count, 0.0),
        }
        if let Role::Output(key) = buffer.role {
            upload.outputs.push((key, first as u64, count as u64));
        }
    }
    // An empty binding is not allowed.
    upload.positions.push(0);
    upload
}

/// One value for all cells of the plate, at each of them.
fn spread(bound: &Bound<'_, f32>, buffer: BufferId, cells: &[f32]) -> impl Iterator<Item = f32> {
    let extents = bound.kernel.buffers[buffer].axes.iter().map(|axis| bound.extent(*axis));
    let axes: Vec<(usize, usize)> = extents.zip(bound.strides(buffer)).rev().collect();
    (0..bound.length(buffer)).map(move |at| {
        let ordinals = radix::ordinals(at, axes.iter().map(|(extent, _)| *extent));
        cells[axes.iter().zip(ordinals).map(|((_, stride), ordinal)| ordinal * stride).sum::<usize>()]
    })
}

impl GpuRun<'_> {
    /// Computes the outputs and waits for them.
    pub fn dispatch(&self) {
        let gpu = self.gpu;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_bind_group(0, &self.bindings, &[]);
            for (pipeline, (x, y)) in self.ready.pipelines.iter().zip(&self.groups) {
                pass.set_pipeline(pipeline);
                pass.dispatch_workgroups(*x, *y, 1);
            }
        }
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("internal: the device answers");
    }

    /// Copies the outputs back.
    pub fn outputs(&self) -> Outputs<f32> {
        let gpu = self.gpu;
        let read = |(key, first, count): &(OutputKey, u64, u64)| {
            let size = 4 * count;
            let copy = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&self.numbers, 4 * first, &copy, 0, size);
            gpu.queue.submit([encoder.finish()]);
            copy.slice(..)
                .map_async(wgpu::MapMode::Read, |mapped| mapped.expect("internal: it is read only"));
            gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("internal: the device answers");
            let bytes = copy.slice(..).get_mapped_range().expect("internal: it has been mapped");
            let number = |bytes: &[u8; 4]| f32::from_le_bytes(*bytes);
            (*key, bytes.as_chunks::<4>().0.iter().map(number).collect())
        };
        Outputs { arrays: self.outputs.iter().map(read).collect() }
    }
}
