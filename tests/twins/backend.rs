//! The queue on a GPU: pages, large dispatches, and faults as values.

use coarsen::backend::{Access, Binding, Buffer, Device, Exactness, GpuOptions, Kernel, Queue, Selector, adapters};
use coarsen::kernel::rows::VolumeSum;
use coarsen::{Error, Result};

use crate::{SMALL_PAGE, gpu, open};

/// Adds each row's square to `sums[i / 3]` and writes its triple to `thrice`.
struct Triples<'a> {
    rows: &'a Buffer<u32>,
    thrice: &'a mut Buffer<u32>,
    sums: &'a mut Buffer<u32>,
}

impl Kernel for Triples<'_> {
    const NAME: &'static str = "triples";
    const SOURCE: &'static str = "
        fn run(i: u32) {
            let row = load_rows(i);
            store_thrice(i, 3u * row);
            add_sums(i / 3u, row * row);
        }";
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("rows", Access::Read, self.rows),
            Binding::new("thrice", Access::Write, self.thrice),
            Binding::new("sums", Access::Add, self.sums),
        ]
    }

    fn invocations(&self) -> u32 {
        self.rows.len() as u32
    }

    fn run_cpu(&mut self) {
        for (i, &row) in self.rows.host().iter().enumerate() {
            self.thrice.host_mut()[i] = row.wrapping_mul(3);
            let sum = &mut self.sums.host_mut()[i / 3];
            *sum = sum.wrapping_add(row.wrapping_mul(row));
        }
    }
}

/// Runs [`Triples`] on the numbers `0 .. len`; returns what it wrote.
fn triples(queue: &mut Queue, len: u32) -> Result<(Vec<u32>, Vec<u32>)> {
    let rows = queue.buffer_from((0..len).map(|i| i ^ 0x5555).collect::<Vec<_>>())?;
    let mut thrice = queue.buffer(rows.len())?;
    let mut sums = queue.buffer(rows.len() / 3 + 1)?;
    queue.run(Triples { rows: &rows, thrice: &mut thrice, sums: &mut sums })?;
    let (mut thrice_rows, mut sum_rows) = (Vec::new(), Vec::new());
    queue.read(&thrice, 0..thrice.len(), &mut thrice_rows)?;
    queue.read(&sums, 0..sums.len(), &mut sum_rows)?;
    Ok((thrice_rows, sum_rows))
}

/// A kernel whose source is not WGSL.
struct Misspelled<'a>(&'a mut Buffer<u32>);

impl Kernel for Misspelled<'_> {
    const NAME: &'static str = "misspelled";
    const SOURCE: &'static str = "fn run(i: u32) { stroe_rows(i, 1u); }";
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![Binding::new("rows", Access::Write, self.0)]
    }

    fn invocations(&self) -> u32 {
        self.0.len() as u32
    }

    fn run_cpu(&mut self) {}
}

/// Sums each workgroup's rows in workgroup memory: a kernel with its own entry.
struct GroupSums<'a> {
    rows: &'a Buffer<u32>,
    sums: &'a mut Buffer<u32>,
}

impl Kernel for GroupSums<'_> {
    const NAME: &'static str = "group_sums";
    const SOURCE: &'static str = "
        var<workgroup> total: atomic<u32>;

        @compute @workgroup_size(WORKGROUP)
        fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
            let i = group.x * WORKGROUP + lane;
            if i < params.invocations {
                atomicAdd(&total, load_rows(i));
            }
            workgroupBarrier();
            if lane == 0u {
                store_sums(group.x, atomicLoad(&total));
            }
        }";
    const WORKGROUP: u32 = 128;
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![Binding::new("rows", Access::Read, self.rows), Binding::new("sums", Access::Write, self.sums)]
    }

    fn invocations(&self) -> u32 {
        self.rows.len() as u32
    }

    fn run_cpu(&mut self) {
        for (rows, sum) in self.rows.host().chunks(128).zip(self.sums.host_mut()) {
            *sum = rows.iter().sum();
        }
    }
}

/// Turns rows and adds the bits of others to them: every type that texels hold.
struct Turned<'a> {
    rows: &'a mut Buffer<[u32; 4]>,
    fours: &'a Buffer<[f32; 4]>,
    twos: &'a Buffer<[f32; 2]>,
    ones: &'a Buffer<f32>,
}

impl Kernel for Turned<'_> {
    const NAME: &'static str = "turned";
    const SOURCE: &'static str = "
        fn run(i: u32) {
            let beside = vec4u(bitcast<vec2u>(load_twos(i)), bitcast<u32>(load_ones(i)), i);
            store_rows(i, load_rows(i).yzwx + bitcast<vec4u>(load_fours(i)) + beside);
        }";
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("rows", Access::Write, self.rows),
            Binding::new("fours", Access::Read, self.fours),
            Binding::new("twos", Access::Read, self.twos),
            Binding::new("ones", Access::Read, self.ones),
        ]
    }

    fn invocations(&self) -> u32 {
        self.rows.len() as u32
    }

    fn run_cpu(&mut self) {
        let Self { rows, fours, twos, ones } = self;
        for (i, row) in rows.host_mut().iter_mut().enumerate() {
            let ([x, y], z) = (twos.host()[i].map(f32::to_bits), ones.host()[i].to_bits());
            let (four, beside, [a, b, c, d]) = (fours.host()[i].map(f32::to_bits), [x, y, z, i as u32], *row);
            let turned = [b, c, d, a];
            *row = std::array::from_fn(|k| turned[k].wrapping_add(four[k]).wrapping_add(beside[k]));
        }
    }
}

fn gpu_queue(device: &Device) -> Queue {
    device.gpu_queue().expect("an open GPU")
}

fn message<T>(result: Result<T>) -> String {
    match result {
        Ok(_) => panic!("no error"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn pages_do_not_show() {
    let Some(device) = open(&GpuOptions { page_rows: Some(SMALL_PAGE), ..GpuOptions::default() }) else { return };
    for len in [1, SMALL_PAGE - 1, SMALL_PAGE, SMALL_PAGE + 1, 3 * SMALL_PAGE, 160_000] {
        let want = triples(&mut device.cpu_queue(), len).unwrap();
        assert_eq!(triples(&mut gpu_queue(&device), len).unwrap(), want, "{len} rows");
    }
}

#[test]
fn more_pages_than_an_adapter_binds_are_an_error() {
    let in_buffers = GpuOptions { page_rows: Some(SMALL_PAGE), texels: Some(false), ..GpuOptions::default() };
    let Some(device) = open(&in_buffers) else { return };
    let too_long = gpu_queue(&device).buffer::<u32>(1 << 45);
    assert!(matches!(too_long, Err(Error::Limit(_))), "{too_long:?}");
    // 20, 20 and 7 pages.
    let together = triples(&mut gpu_queue(&device), 20 * SMALL_PAGE);
    let bound =
        adapters().iter().find(|a| device.description().starts_with(&a.name)).map(|a| a.storage_buffers_per_stage);
    assert_eq!(matches!(together, Err(Error::Limit(_))), bound.expect("its report") < 47);
}

#[test]
fn more_than_65535_workgroups() {
    let Some(device) = gpu() else { return };
    let len = 65_536 * 64 + 17;
    let want = triples(&mut device.cpu_queue(), len).unwrap();
    assert!(triples(&mut gpu_queue(device), len).unwrap() == want);
}

#[test]
fn a_kernel_may_have_its_own_entry() {
    let Some(device) = gpu() else { return };
    let run = |mut queue: Queue| {
        let rows = queue.buffer_from((0..1000).collect::<Vec<u32>>()).unwrap();
        let mut sums = queue.buffer(8).unwrap();
        queue.run(GroupSums { rows: &rows, sums: &mut sums }).unwrap();
        let mut read = Vec::new();
        queue.read(&sums, 0..8, &mut read).unwrap();
        read
    };
    let want = run(device.cpu_queue());
    assert_eq!(want[0], 127 * 64);
    assert_eq!(run(gpu_queue(device)), want);
}

#[test]
fn nothing_to_do_is_no_error() {
    let Some(device) = gpu() else { return };
    let mut queue = gpu_queue(device);
    assert_eq!(triples(&mut queue, 0).unwrap(), (vec![], vec![0]));
    let mut empty = queue.buffer::<u32>(0).unwrap();
    queue.write(&mut empty, &[]).unwrap();
    queue.clear(&mut empty, 0).unwrap();
    assert!(empty.is_empty());
}

#[test]
fn writes_clears_and_runs_keep_their_order() {
    let Some(device) = open(&GpuOptions { page_rows: Some(SMALL_PAGE), ..GpuOptions::default() }) else { return };
    let run = |mut queue: Queue| {
        let mut rows = queue.buffer_from(vec![7u32; 80_000]).unwrap();
        let mut thrice = queue.buffer(80_000).unwrap();
        let mut sums = queue.buffer(80_000 / 3 + 1).unwrap();
        let mut read = Vec::new();
        for step in 0..100 {
            queue.run(Triples { rows: &rows, thrice: &mut thrice, sums: &mut sums }).unwrap();
            match step % 50 {
                20 => queue.write(&mut rows, &vec![step; 40_000]).unwrap(),
                30 => queue.clear(&mut rows, 36_000).unwrap(),
                40 => queue.clear(&mut sums, 24_000).unwrap(),
                45 => queue.read(&thrice, 0..72_000, &mut read).unwrap(),
                _ => {}
            }
        }
        queue.read(&sums, 0..sums.len(), &mut read).unwrap();
        read
    };
    assert!(run(gpu_queue(&device)) == run(device.cpu_queue()));
}

/// Whatever holds the rows: a kernel, the host and clears take turns to write all of them, or the first.
#[test]
fn rows_in_texels_are_those_of_buffers() {
    for texels in [None, Some(false), Some(true)] {
        let options = GpuOptions { page_rows: Some(SMALL_PAGE), texels, ..GpuOptions::default() };
        let Some(device) = open(&options) else { return };
        for len in [5, SMALL_PAGE as usize + 7, 20_000] {
            let run = |mut queue: Queue| {
                let number = |i: usize| i as f32 * 0.37 + 1.0;
                let mut rows = queue.buffer_from((0..len as u32).map(|i| [i, 7, i * i, !i]).collect()).unwrap();
                let mut fours = queue.buffer(len).unwrap();
                let twos = queue.buffer_from((0..len).map(|i| [number(i), -number(2 * i)]).collect()).unwrap();
                let ones = queue.buffer_from((0..len).map(number).collect()).unwrap();
                let mut read = Vec::new();
                for step in 0..12 {
                    queue.run(Turned { rows: &mut rows, fours: &fours, twos: &twos, ones: &ones }).unwrap();
                    match step {
                        1 => queue.write(&mut rows, &vec![[step; 4]; len / 2]).unwrap(),
                        3 => queue.clear(&mut rows, len / 3).unwrap(),
                        4 => queue.write(&mut rows, &vec![[step; 4]; len / 4]).unwrap(),
                        6 => queue.write(&mut fours, &vec![[0.3; 4]; len]).unwrap(),
                        7 => queue.write(&mut rows, &vec![[9; 4]; len]).unwrap(),
                        8 => queue.prefetch(&rows, 0..len / 2).unwrap(),
                        9 => queue.read(&rows, 2..len, &mut read).unwrap(),
                        10 => queue.clear(&mut rows, len).unwrap(),
                        _ => {}
                    }
                }
                queue.read(&rows, 0..len, &mut read).unwrap();
                read
            };
            assert!(run(gpu_queue(&device)) == run(device.cpu_queue()), "{texels:?}, {len} rows");
        }
    }
}

/// Rows of three texels, more than are copied at once, so that copies begin and end within lines; then a part of them.
#[test]
fn long_rows_in_texels_are_those_of_buffers() {
    let Some(device) = gpu() else { return };
    let run = |mut queue: Queue| {
        let len = 100_001;
        let sum = |i: usize| VolumeSum { nx: i as f32, ..VolumeSum::default() };
        let mut sums = queue.buffer_from((0..len).map(sum).collect()).unwrap();
        queue.write(&mut sums, &(7..70_007).map(sum).collect::<Vec<_>>()).unwrap();
        let mut read = Vec::new();
        queue.read(&sums, 0..len, &mut read).unwrap();
        read
    };
    assert!(run(gpu_queue(device)) == run(device.cpu_queue()));
}

/// Otherwise the trials of texels would be trials of buffers.
#[test]
fn software_holds_rows_in_texels() {
    let Some(device) = open(&GpuOptions::default()) else { return };
    let mut queue = gpu_queue(&device);
    let rows = queue.buffer_from(vec![[1u32; 4]; 20_000]).unwrap();
    let held = device.gpu_bytes() / (16 * rows.len() as u64);
    assert_eq!(held, if device.is_software() { 2 } else { 1 });
}

#[test]
fn what_was_prefetched_is_read_until_it_changes() {
    let Some(device) = open(&GpuOptions { page_rows: Some(SMALL_PAGE), ..GpuOptions::default() }) else { return };
    let len = 3 * SMALL_PAGE + 5;
    let run = |mut queue: Queue| {
        let mut rows = queue.buffer_from((0..len).collect::<Vec<_>>()).unwrap();
        let mut thrice = queue.buffer(rows.len()).unwrap();
        let mut sums = queue.buffer(rows.len() / 3 + 1).unwrap();
        let mut read = Vec::new();
        for step in 0..3 {
            queue.run(Triples { rows: &rows, thrice: &mut thrice, sums: &mut sums }).unwrap();
            queue.prefetch(&thrice, 0..SMALL_PAGE as usize + 7).unwrap();
            queue.prefetch(&sums, 0..1).unwrap();
            queue.submit().unwrap();
            // Within it, all of it, beyond it, beside it.
            queue.read(&thrice, 0..20, &mut read).unwrap();
            queue.read(&thrice, 3..SMALL_PAGE as usize + 7, &mut read).unwrap();
            queue.read(&sums, 0..1, &mut read).unwrap();
            queue.read(&thrice, 0..thrice.len(), &mut read).unwrap();
            queue.read(&rows, 0..3, &mut read).unwrap();
            match step {
                0 => queue.write(&mut thrice, &[7; 3]).unwrap(),
                1 => queue.clear(&mut thrice, 4).unwrap(),
                _ => {}
            }
            queue.read(&thrice, 0..20, &mut read).unwrap();
            queue.write(&mut rows, &[step; 9]).unwrap();
        }
        assert!(queue.prefetch(&thrice, 0..thrice.len() + 1).is_err());
        read
    };
    assert!(run(gpu_queue(&device)) == run(device.cpu_queue()));
}

#[test]
fn kernels_are_timed_where_asked_for() {
    let Some(untimed) = gpu() else { return };
    triples(&mut gpu_queue(untimed), 50).unwrap();
    assert_eq!(untimed.kernel_times(), []);
    assert_eq!(untimed.cpu_queue().bytes_moved(), 0);

    let Some(device) = open(&GpuOptions { time_kernels: true, ..GpuOptions::default() }) else { return };
    device.forget_kernel_times();
    for _ in 0..3 {
        triples(&mut gpu_queue(&device), 1 << 20).unwrap();
    }
    let times = device.kernel_times();
    if times.is_empty() {
        return println!("skipped: the adapter has no clock");
    }
    assert_eq!((times.len(), times[0].name, times[0].runs), (1, "triples", 3));
    assert!(times[0].ms > 0.0 && times[0].ms < 1e4, "{times:?}");
    device.forget_kernel_times();
    assert_eq!(device.kernel_times(), []);
}

/// Software must pass with its own division and square root: a run takes half as long again with the guarded ones.
#[test]
fn software_needs_no_guarded_division() {
    let Some(device) = gpu().filter(|device| device.is_software()) else { return };
    let plain = GpuOptions { exactness: Some(Exactness::Plain), ..GpuOptions::default() };
    let opened = Device::open_with(&Selector::Software, 1, &plain);
    assert!(opened.is_ok(), "{}: {}", device.description(), message(opened));
}

#[test]
fn a_lost_gpu_is_an_error() {
    let Some(device) = open(&GpuOptions::default()) else { return };
    let mut queue = gpu_queue(&device);
    let mut rows = queue.buffer_from(vec![1u32, 2, 3]).unwrap();
    let mut other = queue.buffer::<u32>(3).unwrap();
    let mut sums = queue.buffer::<u32>(2).unwrap();
    queue.run(Triples { rows: &rows, thrice: &mut other, sums: &mut sums }).unwrap();
    device.lose_gpu();
    let mut read = vec![9];
    let error = message(queue.read(&other, 0..3, &mut read));
    assert!(error.contains("the GPU was lost"), "{error}");
    assert_eq!(read, [9]);
    assert!(message(queue.run(Triples { rows: &rows, thrice: &mut other, sums: &mut sums })).contains("lost"));
    assert!(message(queue.write(&mut rows, &[4])).contains("lost"));
    assert!(message(queue.buffer::<u32>(10)).contains("lost"));
    assert!(message(triples(&mut gpu_queue(&device), 10)).contains("lost"));
    // The CPU can finish.
    assert_eq!(triples(&mut device.cpu_queue(), 3).unwrap().0, [0x5555 * 3, 0x5554 * 3, 0x5557 * 3]);
}

#[test]
fn the_memory_limit_is_an_error() {
    let Some(device) = open(&GpuOptions { memory_limit: Some(8 << 20), ..GpuOptions::default() }) else { return };
    let queue = gpu_queue(&device);
    let first = queue.buffer::<u32>(1 << 20).unwrap();
    let error = queue.buffer::<u32>((1 << 20) + 1);
    assert!(matches!(error, Err(Error::Limit(_))), "{error:?}");
    assert_eq!(device.gpu_bytes(), 4 << 20);
    drop(first);
    assert_eq!(device.gpu_bytes(), 0);
    queue.buffer::<u32>((1 << 20) + 1).unwrap();
}

#[test]
fn an_impossible_allocation_is_an_error() {
    let Some(device) = gpu() else { return };
    let mut queue = gpu_queue(device);
    let error = queue.buffer::<u32>(1 << 50);
    assert!(matches!(error, Err(Error::Limit(_))), "{error:?}");
    triples(&mut queue, 100).expect("the device goes on");
}

#[test]
fn a_bad_kernel_is_an_error() {
    let Some(device) = gpu() else { return };
    let mut queue = gpu_queue(device);
    let mut rows = queue.buffer(5).unwrap();
    // Kernels are compiled when they are submitted, all at once.
    let error = message(queue.run(Misspelled(&mut rows)).and_then(|()| queue.submit()));
    assert!(error.contains("misspelled") && error.contains("stroe_rows"), "{error}");
    triples(&mut queue, 100).expect("the device goes on");
}

#[test]
fn misplaced_buffers_and_rows_are_errors() {
    let Some(device) = gpu() else { return };
    let (cpu, mut queue) = (device.cpu_queue(), gpu_queue(device));
    let mut on_host = cpu.buffer::<u32>(3).unwrap();
    assert!(message(queue.write(&mut on_host, &[1])).contains("on the host"));
    let mut on_gpu = queue.buffer::<u32>(3).unwrap();
    assert!(message(queue.write(&mut on_gpu, &[1; 4])).contains("4 rows in a buffer of 3"));
    assert!(message(queue.read(&on_gpu, 0..4, &mut Vec::new())).contains("4 rows"));
}

#[test]
fn bytes_moved_are_counted() {
    let Some(device) = gpu() else { return };
    let mut queue = gpu_queue(device);
    triples(&mut queue, 99).unwrap();
    assert_eq!(queue.bytes_moved(), 4 * (99 + 99 + 34));
}

#[test]
fn adapters_and_devices_are_described() {
    let Some(device) = gpu() else { return };
    let reports = adapters();
    assert!(reports.iter().zip(0..).all(|(report, index)| report.index == index));
    assert!(reports.is_sorted_by_key(|report| report.kind == "software"));
    let own = reports.iter().find(|report| device.description().starts_with(&report.name)).expect("its own report");
    assert!(own.usable && device.description().ends_with(&own.driver), "{own:?}, {}", device.description());
    assert!(own.max_binding_bytes >= 128 << 20, "{own:?}");
    assert_eq!(reports, adapters());
    let by_name = Device::open(&Selector::Name(own.name.to_uppercase()), 1).unwrap();
    assert_eq!(by_name.description(), device.description());
    let beyond = message(Device::open(&Selector::Index(reports.len()), 1));
    assert!(beyond.contains(&own.name), "{beyond}");
}

#[test]
fn threads_may_share_a_device() {
    let Some(device) = gpu() else { return };
    let want = triples(&mut device.cpu_queue(), 50_000).unwrap();
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                for _ in 0..5 {
                    assert!(triples(&mut gpu_queue(device), 50_000).unwrap() == want);
                }
            });
        }
    });
}
