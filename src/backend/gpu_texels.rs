//! Rows of a buffer in textures, for software: lavapipe loads what is in a buffer lane by lane, each after the one before, and
//! what is in a texture for a whole vector of lanes.

use std::ops::Range;

use super::gpu_buffer::Lease;

/// The binary logarithm of the texels in a line: a line of the smallest is whole multiples of what copies are aligned to. Other
/// widths were not tried.
pub const LINE_SHIFT: u32 = 12;
/// Bytes of a texel at most: four words.
pub const TEXEL_BYTES: u64 = 16;

const LINE: u32 = 1 << LINE_SHIFT;

/// What kernels need of an adapter that keep rows in textures.
pub const FEATURES: wgpu::Features = wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES;

/// The format of the texels of rows that have so many bytes on a GPU, and its name in WGSL.
pub fn format(stride: u64) -> (wgpu::TextureFormat, &'static str) {
    match stride {
        4 => (wgpu::TextureFormat::R32Uint, "r32uint"),
        8 => (wgpu::TextureFormat::Rg32Uint, "rg32uint"),
        _ => (wgpu::TextureFormat::Rgba32Uint, "rgba32uint"),
    }
}

/// Whether an adapter's kernels can load and store texels.
pub fn are_usable(adapter: &wgpu::Adapter) -> bool {
    let can = |stride, access| adapter.get_texture_format_features(format(stride).0).flags.contains(access);
    adapter.features().contains(FEATURES)
        && [4, 8].into_iter().all(|stride| can(stride, wgpu::TextureFormatFeatureFlags::STORAGE_READ_ONLY))
        && can(TEXEL_BYTES, wgpu::TextureFormatFeatureFlags::STORAGE_READ_WRITE)
}

/// The texels of a buffer.
#[derive(Debug)]
pub struct Texels {
    pages: Vec<TexelPage>,
    _lease: Lease,
}

/// The texels of a page, line by line.
#[derive(Debug, Clone)]
pub struct TexelPage {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    texel_bytes: u32,
}

/// A rectangle of texels that follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Region {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

/// Which way rows are copied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// From a buffer to texels.
    In,
    /// From texels to a buffer.
    Out,
}

impl Texels {
    /// Zeroed texels for pages whose rows are of so many bytes. Allocation faults go to the device's error scope.
    pub fn new(device: &wgpu::Device, pages: &[wgpu::Buffer], stride: u64, lease: Lease) -> Self {
        Self { pages: pages.iter().map(|page| TexelPage::new(device, page.size(), stride)).collect(), _lease: lease }
    }

    /// Bytes that they take for such pages.
    pub fn bytes(pages: &[wgpu::Buffer], stride: u64) -> u64 {
        let texels = |size: wgpu::Extent3d| u64::from(size.width) * u64::from(size.height);
        pages.iter().map(|page| texels(size(texel_count(page.size(), stride))) * stride.min(TEXEL_BYTES)).sum()
    }

    /// In the order of the pages.
    pub fn pages(&self) -> &[TexelPage] {
        &self.pages
    }
}

impl TexelPage {
    fn new(device: &wgpu::Device, page_bytes: u64, stride: u64) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: size(texel_count(page_bytes, stride)),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: format(stride).0,
            usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self { texture, view, texel_bytes: stride.min(TEXEL_BYTES) as u32 }
    }

    /// What a pass binds.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Records the copy of what a buffer begins with to these bytes of the page, or back.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder, way: Way, buffer: &wgpu::Buffer, page_bytes: Range<u64>) {
        for (region, offset) in self.regions(page_bytes) {
            let layout = wgpu::TexelCopyBufferLayout { offset, ..self.layout() };
            let (in_buffer, in_texels) = (wgpu::TexelCopyBufferInfo { buffer, layout }, self.origin(region));
            match way {
                Way::In => encoder.copy_buffer_to_texture(in_buffer, in_texels, region.extent()),
                Way::Out => encoder.copy_texture_to_buffer(in_texels, in_buffer, region.extent()),
            }
        }
    }

    /// Writes bytes that stand from `offset` on in the page.
    pub fn write(&self, queue: &wgpu::Queue, offset: u64, bytes: &[u8]) {
        for (region, first) in self.regions(offset..offset + bytes.len() as u64) {
            queue.write_texture(self.origin(region), &bytes[first as usize..], self.layout(), region.extent());
        }
    }

    fn layout(&self) -> wgpu::TexelCopyBufferLayout {
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(LINE * self.texel_bytes), rows_per_image: None }
    }

    fn origin(&self, Region { x, y, .. }: Region) -> wgpu::TexelCopyTextureInfo<'_> {
        wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x, y, z: 0 }, ..self.texture.as_image_copy() }
    }

    /// The regions that these bytes of a page fill, each with how many bytes of theirs come before.
    fn regions(&self, bytes: Range<u64>) -> impl Iterator<Item = (Region, u64)> {
        let texel_bytes = u64::from(self.texel_bytes);
        let [start, end] = [bytes.start, bytes.end].map(|byte| (byte / texel_bytes) as u32);
        regions(start..end).map(move |(region, before)| (region, u64::from(before) * texel_bytes))
    }
}

impl Region {
    fn extent(self) -> wgpu::Extent3d {
        wgpu::Extent3d { width: self.width, height: self.height, depth_or_array_layers: 1 }
    }
}

/// The rectangles that texels fill: the end of a line, whole lines, the start of one; each with how many texels come before.
fn regions(texels: Range<u32>) -> impl Iterator<Item = (Region, u32)> {
    let mut at = texels.start;
    std::iter::from_fn(move || {
        let (x, left) = (at % LINE, texels.end - at);
        let [width, height] = if x == 0 && left >= LINE { [LINE, left / LINE] } else { [left.min(LINE - x), 1] };
        let found = (Region { x, y: at / LINE, width, height }, at - texels.start);
        at += width * height;
        (left > 0).then_some(found)
    })
}

/// How many lines the texels of a page of so many bytes take.
pub fn lines(page_bytes: u64, stride: u64) -> u64 {
    u64::from(size(texel_count(page_bytes, stride)).height)
}

/// The texels of a page; of one that no texture holds, more than any does.
fn texel_count(page_bytes: u64, stride: u64) -> u32 {
    u32::try_from(page_bytes / stride.min(TEXEL_BYTES)).unwrap_or(u32::MAX)
}

/// The size of a texture for so many texels. The driver compiles a kernel anew where a side is a power of two and was none
/// before, or the other way round: the width always is one, and the height never, so that it is three or more.
fn size(texels: u32) -> wgpu::Extent3d {
    let lines = texels.div_ceil(LINE).max(3);
    let (width, height) = (texels.clamp(1, LINE).next_power_of_two(), lines + u32::from(lines.is_power_of_two()));
    wgpu::Extent3d { width, height, depth_or_array_layers: 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_fill_lines() {
        let filled = |texels: Range<u32>| -> Vec<[u32; 5]> {
            let flat = |(Region { x, y, width, height }, before)| [x, y, width, height, before];
            regions(texels).map(flat).collect()
        };
        assert_eq!(filled(7..7), [[0; 5]; 0]);
        assert_eq!(filled(0..9), [[0, 0, 9, 1, 0]]);
        assert_eq!(filled(4_090..4_100), [[4_090, 0, 6, 1, 0], [0, 1, 4, 1, 6]]);
        assert_eq!(filled(4_096..12_288), [[0, 1, 4_096, 2, 0]]);
        assert_eq!(filled(1..12_289), [[1, 0, 4_095, 1, 0], [0, 1, 4_096, 2, 4_095], [0, 3, 1, 1, 12_287]]);
    }

    #[test]
    fn the_width_alone_is_a_power_of_two() {
        let sides = |texels| (size(texels).width, size(texels).height);
        assert_eq!([1, 3, 4_096, 4_097].map(sides), [(1, 3), (4, 3), (4_096, 3), (4_096, 3)]);
        assert_eq!([4, 7, 8].map(|lines| sides(lines * LINE).1), [5, 7, 9]);
        assert_eq!(lines(16 * 4_096 * 5, 48), 5);
    }
}
