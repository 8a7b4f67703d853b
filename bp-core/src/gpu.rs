//! Kernels on a graphics processor, by WebGPU: the shaders of [`crate::emit::wgsl`], run.
//!
//! In: a kernel and its inputs, in f32. Out: its outputs. Invariant: the same inputs are checked in the same way as
//! by the other back ends; where there is no adapter there is no [`Gpu`], and nothing else fails.
//!
//! Needs the feature `gpu`. A software adapter, such as that of Mesa, will do.

use crate::emit::wgsl::{Layout, MOST_WORKGROUPS, Shader, WORKGROUP, emit_wgsl};
use crate::error::Error;
use crate::exec::{Array, Bound, Inputs, Outputs};
use crate::kernel::Kernel;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BufferUsages, ShaderStages};

/// A device that runs kernels.
#[derive(Debug)]
pub struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    name: String,
    /// Bytes of one buffer, at most.
    most: u64,
}

/// A kernel that is ready to be run on a device.
#[derive(Debug)]
pub struct GpuKernel<'g> {
    gpu: &'g Gpu,
    kernel: Kernel,
    shader: Shader,
    layout: Layout,
    bindings: wgpu::BindGroupLayout,
    pipelines: Vec<wgpu::ComputePipeline>,
}

/// A kernel whose inputs are on the device.
#[derive(Debug)]
pub struct GpuRun<'k> {
    ready: &'k GpuKernel<'k>,
    numbers: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    /// Workgroups of each pass.
    groups: Vec<(u32, u32)>,
    /// Name, first number and count of each output.
    outputs: Vec<(String, u64, u64)>,
}

impl Gpu {
    /// The most powerful device of this machine; `None` where it has none.
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

    /// What the device is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Compiles a kernel for the device.
    pub fn compile(&self, kernel: Kernel) -> GpuKernel<'_> {
        let shader = emit_wgsl(&kernel);
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
        GpuKernel { gpu: self, layout: Layout::of(&kernel), kernel, shader, bindings, pipelines }
    }
}

impl GpuKernel<'_> {
    /// Runs the kernel once.
    ///
    /// # Errors
    /// An input that is missing or does not fit; arrays that are larger than what the device takes.
    pub fn run(&self, inputs: &Inputs<'_, f32>) -> Result<Outputs<f32>, Error> {
        let run = self.load(inputs)?;
        run.dispatch();
        Ok(run.outputs())
    }

    /// Brings the inputs to the device.
    ///
    /// # Errors
    /// As [`GpuKernel::run`].
    pub fn load(&self, inputs: &Inputs<'_, f32>) -> Result<GpuRun<'_>, Error> {
        let bound = inputs.bind(&self.kernel)?;
        let (numbers, positions, shape, outputs) = self.arrange(&bound);
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
        let shape = buffer(shape.into_iter().flat_map(u32::to_le_bytes).collect());
        let bindings = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.bindings,
            entries: &[&numbers, &positions, &shape]
                .map(wgpu::Buffer::as_entire_binding)
                .into_iter()
                .enumerate()
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding: binding as u32, resource })
                .collect::<Vec<_>>(),
        });
        let groups = self.shader.passes.iter().map(|pass| {
            let cells: usize = pass.axes.iter().map(|axis| bound.extent(*axis)).product();
            let groups = (cells as u32).div_ceil(WORKGROUP);
            (groups.min(MOST_WORKGROUPS), groups.div_ceil(MOST_WORKGROUPS))
        });
        Ok(GpuRun { ready: self, numbers, bindings, groups: groups.collect(), outputs })
    }

    /// All numbers in one array, all positions in another, and where everything is.
    #[allow(clippy::type_complexity)] // four arrays, named where they are taken apart
    fn arrange(&self, bound: &Bound<'_, f32>) -> (Vec<f32>, Vec<i32>, Vec<u32>, Vec<(String, u64, u64)>) {
        let (mut numbers, mut positions, mut outputs) = (Vec::new(), Vec::new(), Vec::new());
        let mut shape = vec![0; self.layout.length];
        shape[0] = f32::INFINITY.to_bits();
        for axis in self.kernel.axes.ids() {
            shape[self.layout.extent(axis)] = bound.extent(axis) as u32;
        }
        for id in self.kernel.buffers.ids() {
            let place = self.layout.buffer(id);
            shape[place] = numbers.len() as u32;
            for (position, stride) in bound.strides(id).into_iter().enumerate() {
                shape[place + 1 + position] = stride as u32;
            }
            match &bound.arrays[id] {
                Array::Given(cells) | Array::Broadcast(cells) => numbers.extend_from_slice(cells),
                Array::Owned(cells) => numbers.extend_from_slice(cells),
                Array::Default => numbers.push(bound.default(id) as f32),
                Array::Positions(cells) => {
                    shape[place] = positions.len() as u32;
                    positions.extend_from_slice(cells);
                }
                Array::Made => numbers.resize(numbers.len() + bound.length(id), 0.0),
            }
        }
        for (id, buffer) in self.kernel.outputs() {
            let first = u64::from(shape[self.layout.buffer(id)]);
            outputs.push((buffer.name.clone(), first, bound.length(id) as u64));
        }
        // A binding of nothing is not allowed.
        positions.push(0);
        (numbers, positions, shape, outputs)
    }
}

impl GpuRun<'_> {
    /// Computes the outputs, and waits for them.
    pub fn dispatch(&self) {
        let gpu = self.ready.gpu;
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

    /// Brings the outputs back.
    pub fn outputs(&self) -> Outputs<f32> {
        let gpu = self.ready.gpu;
        let read = |(name, first, count): &(String, u64, u64)| {
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
            (name.clone(), bytes.as_chunks::<4>().0.iter().map(number).collect())
        };
        Outputs { arrays: self.outputs.iter().map(read).collect() }
    }
}
