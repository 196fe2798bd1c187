//! A kernel's compute pipeline and its explicit layout.

use std::num::NonZeroU64;
use std::sync::Mutex;

use super::Access;
use super::gpu::Gpu;
use super::gpu_buffer::{Form, GpuBuffer, stride};
use super::gpu_faults::lock;
use super::gpu_texels::{Texels, format};
use super::module::{PageShape, Signature};
use crate::error::{Error, Result};

/// A buffer as a kernel binds it.
#[derive(Debug, Clone, Copy)]
pub struct Bound<'a> {
    /// The buffer.
    pub buffer: &'a GpuBuffer,
    /// Its texels, where they are bound instead of its pages.
    pub texels: Option<&'a Texels>,
}

impl<'a> Bound<'a> {
    /// What is bound.
    pub fn form(self) -> Form {
        if self.texels.is_some() { Form::Texels } else { Form::Buffers }
    }

    /// How it is cut into bindings.
    pub fn shape(self) -> PageShape {
        PageShape { are_texels: self.texels.is_some(), ..self.buffer.shape() }
    }

    fn resources(self) -> Vec<wgpu::BindingResource<'a>> {
        match self.texels {
            Some(texels) => texels.pages().iter().map(|page| wgpu::BindingResource::TextureView(page.view())).collect(),
            None => self.buffer.pages().iter().map(wgpu::Buffer::as_entire_binding).collect(),
        }
    }
}

/// A kernel, for one way of cutting its buffers into pages. It takes milliseconds to compile, with some drivers many more: that is
/// left for when all that run with it are known, so that threads can share them.
#[derive(Debug)]
pub struct Pipeline {
    /// The kernel's name.
    pub name: &'static str,
    text: String,
    layout: wgpu::BindGroupLayout,
    uniform_bytes: NonZeroU64,
    /// What a pass sets, once it is compiled.
    compiled: Mutex<Option<wgpu::ComputePipeline>>,
}

impl Pipeline {
    /// Composes the kernel's module.
    ///
    /// # Errors
    /// [`Error::Limit`] when the pages are more than the adapter can bind, [`Error::Device`] when it refuses the layout.
    pub fn new(gpu: &Gpu, signature: &Signature<'_>, pages: &[PageShape]) -> Result<Self> {
        let in_buffers = pages.iter().filter(|page| !page.are_texels);
        let (needed, limit) = (in_buffers.map(|page| page.count).sum::<u32>(), gpu.max_pages());
        if needed > limit {
            return Err(Error::Limit(format!(
                "this adapter binds too few storage buffers for the mesh: '{}' needs {needed}, {} has {limit}",
                signature.name,
                gpu.description()
            )));
        }
        let uniform_bytes = NonZeroU64::MIN.saturating_add(signature.uniform_bytes() as u64 - 1);
        let layout = gpu.guard(&refusal(signature.name), || {
            gpu.device().create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(signature.name),
                entries: &entries(signature, pages, uniform_bytes),
            })
        })?;
        let text = signature.compose(pages, gpu.dialect());
        Ok(Self { name: signature.name, text, layout, uniform_bytes, compiled: Mutex::new(None) })
    }

    /// What a pass sets: validated and compiled, unless that was done. After an error it is tried again.
    ///
    /// # Errors
    /// [`Error::Device`] when the device refuses it.
    pub fn compile(&self, gpu: &Gpu) -> Result<wgpu::ComputePipeline> {
        let mut compiled = lock(&self.compiled);
        if let Some(pipeline) = &*compiled {
            return Ok(pipeline.clone());
        }
        let pipeline = gpu.guard(&refusal(self.name), || {
            let device = gpu.device();
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(self.name),
                source: wgpu::ShaderSource::Wgsl(self.text.as_str().into()),
            });
            let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(self.name),
                bind_group_layouts: &[Some(&self.layout)],
                immediate_size: 0,
            });
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(self.name),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some("main"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
        })?;
        Ok(compiled.insert(pipeline).clone())
    }

    /// What a pass sets, if it is compiled.
    pub fn compiled(&self) -> Option<wgpu::ComputePipeline> {
        lock(&self.compiled).clone()
    }

    /// Binds a uniform block in `uniforms` (at a dynamic offset) and these buffers.
    pub fn bind(&self, device: &wgpu::Device, uniforms: &wgpu::Buffer, buffers: &[Bound<'_>]) -> wgpu::BindGroup {
        let block = wgpu::BufferBinding { buffer: uniforms, offset: 0, size: Some(self.uniform_bytes) };
        let pages = buffers.iter().flat_map(|bound| bound.resources());
        let resources = std::iter::once(wgpu::BindingResource::Buffer(block)).chain(pages);
        let entries: Vec<_> =
            resources.zip(0..).map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource }).collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &self.layout, entries: &entries })
    }
}

fn refusal(name: &str) -> String {
    format!("the kernel '{name}' was refused")
}

fn entries(
    signature: &Signature<'_>,
    pages: &[PageShape],
    uniform_bytes: NonZeroU64,
) -> Vec<wgpu::BindGroupLayoutEntry> {
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: true,
        min_binding_size: Some(uniform_bytes),
    };
    let storage = signature.bindings.iter().zip(pages).flat_map(|(binding, shape)| {
        let read_only = binding.access == Access::Read;
        let ty = match shape.are_texels {
            true => wgpu::BindingType::StorageTexture {
                access: match read_only {
                    true => wgpu::StorageTextureAccess::ReadOnly,
                    false => wgpu::StorageTextureAccess::ReadWrite,
                },
                format: format(stride(binding.stride)).0,
                view_dimension: wgpu::TextureViewDimension::D2,
            },
            false => wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
        };
        (0..shape.count).map(move |_| ty)
    });
    let types = std::iter::once(uniform).chain(storage);
    types
        .zip(0..)
        .map(|(ty, binding)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        })
        .collect()
}
