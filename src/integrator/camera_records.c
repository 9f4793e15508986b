/* Camera paths of a block, traced once and kept: where they look for photons, and what they find without them. */
#include "integrator/qmcppm.h"

#include "base/memory.h"

#include <string.h>

/* Tasks of one step when records are filled into the memory. */
enum { FILL_TASKS = 32 };

/* What a walk fills. */
typedef struct record_walk {
    const ca_qmcppm *q;
    ca_camera_task *task;
} record_walk;

/* ---- One camera path ------------------------------------------------------------------------------------------- */

/* Was there a Dirac event before the last vertex? */
static bool met_dirac(const ca_camera_walk *walk)
{
    const uint32_t before = walk->walk.vertex - 1;
    return walk->walk.densities[before].connectable_count < before;
}

static bool shows_light(const ca_camera_walk *walk)
{
    const record_walk *record = walk->user;
    return ca_qmcppm_shows(record->q, met_dirac(walk));
}

static float initial_radius(const ca_qmcppm *q, ca_vec3 position)
{
    const float radius0 = q->engine->radius0;
    if (q->radius_photons == 0) return radius0;
    const float distance = ca_photon_grid_nearest(q->pilot, position, q->radius_photons);
    return ca_clamp(distance * q->pilot_scale, radius0 / CA_LOCAL_RADIUS_RANGE, radius0 * CA_LOCAL_RADIUS_RANGE);
}

/* Called at every vertex that scatters smoothly. */
static void keep_vertex(ca_camera_walk *walk)
{
    const record_walk *record = walk->user;
    const ca_qmcppm *q = record->q;
    ca_camera_task *task = record->task;
    const bool dirac = met_dirac(walk);
    if (!q->direct_photons && ca_qmcppm_shows(q, dirac)) ca_next_event_now(walk, false);
    ca_gather_vertex *vertices =
        ca_array_grow(task->vertices, &task->vertex_capacity, task->vertex_count + 1, sizeof *vertices);
    if (!vertices) {
        task->failed = true;
        return;
    }
    task->vertices = vertices;
    task->vertices[task->vertex_count++] =
        (ca_gather_vertex){.point = ca_vertex_point(&walk->walk.last),
                           .wi = walk->walk.last.wi,
                           .throughput = walk->walk.throughput,
                           .radius0 = initial_radius(q, walk->walk.last.position),
                           .vertex = (uint16_t)walk->walk.vertex,
                           .dirac = dirac};
}

static void keep_densities(const ca_qmcppm *q, const ca_camera_walk *walk, ca_camera_task *task,
                           ca_camera_record *record)
{
    record->densities = (uint32_t)task->density_count;
    if (!q->weighted || record->count == 0) return;
    const uint32_t count = walk->walk.vertex + 1;
    ca_path_vertex *densities =
        ca_array_grow(task->densities, &task->density_capacity, task->density_count + count, sizeof *densities);
    if (!densities) {
        task->failed = true;
        return;
    }
    task->densities = densities;
    memcpy(&task->densities[task->density_count], walk->walk.densities, count * sizeof *task->densities);
    task->density_count += count;
}

static void trace_path(const ca_qmcppm *q, uint64_t number, ca_camera_task *task, ca_camera_record *record,
                       ca_worker *worker)
{
    static const ca_walk_hooks hooks = {.at_vertex = keep_vertex, .shows_light = shows_light};
    const uint32_t *crop = q->input.crop;
    const uint64_t pixel = number % q->pixels;
    const uint32_t width = crop[2] - crop[0];
    record_walk user = {.q = q, .task = task};
    ca_camera_walk *walk = &q->engine->scratch[worker->index].camera_walks[0];
    *record = (ca_camera_record){.first = (uint32_t)task->vertex_count};
    ca_camera_path path = {.x = crop[0] + (uint32_t)(pixel % width),
                           .y = crop[1] + (uint32_t)(pixel / width),
                           .index = (uint32_t)(number / q->pixels),
                           .sample = &record->sample};
    ca_camera_walk_start(walk, q->engine, &path, 0, worker);
    walk->hooks = &hooks;
    walk->user = &user;
    worker->counters.camera_paths++;
    if (q->engine->max_depth > 0) ca_camera_walks_trace(&walk, 1);
    record->count = (uint32_t)task->vertex_count - record->first;
    record->own_light = walk->light[0];
    keep_densities(q, walk, task, record);
}

/* ---- A block --------------------------------------------------------------------------------------------------- */

typedef struct trace_job {
    ca_qmcppm *q;
    ca_worker *workers;
    uint32_t first_task;
} trace_job;

static void trace_task(void *user, uint32_t index, uint32_t worker)
{
    const trace_job *job = user;
    ca_camera_records *records = &job->q->camera;
    const uint64_t number = job->first_task + index, begin = number * CA_CAMERA_TASK;
    const uint64_t end = begin + CA_CAMERA_TASK < records->count ? begin + CA_CAMERA_TASK : records->count;
    ca_camera_task *task = &records->tasks[number];
    task->vertex_count = task->density_count = 0;
    task->failed = false;
    for (uint64_t i = begin; i < end; i++)
        trace_path(job->q, records->first + i, task, &records->records[i], &job->workers[worker]);
}

static size_t task_count(uint64_t paths) { return (size_t)((paths + CA_CAMERA_TASK - 1) / CA_CAMERA_TASK); }

static bool make_room(ca_camera_records *records, uint64_t count, size_t tasks)
{
    ca_camera_record *grown = ca_array_grow(records->records, &records->record_capacity, count, sizeof *grown);
    if (!grown) return false;
    records->records = grown;
    ca_camera_task *grown_tasks = ca_array_grow(records->tasks, &records->task_capacity, tasks, sizeof *grown_tasks);
    if (!grown_tasks) return false;
    records->tasks = grown_tasks;
    return true;
}

/* Room for `count` records and their tasks, and the tasks [first_task, ...) of them traced. */
static ca_status trace_tasks(ca_qmcppm *q, uint32_t first_task, uint64_t count, const ca_parallel *parallel,
                             ca_worker *workers, ca_error *error)
{
    ca_camera_records *records = &q->camera;
    const size_t tasks = task_count(count);
    if (!make_room(records, count, tasks)) return ca_fail_memory(error, "the camera paths");
    for (; records->task_count < tasks; records->task_count++)
        records->tasks[records->task_count] = (ca_camera_task){0};
    records->count = count;
    trace_job job = {.q = q, .workers = workers, .first_task = first_task};
    ca_parallel_for(parallel, (uint32_t)(tasks - first_task), trace_task, &job);
    for (size_t i = first_task; i < tasks; i++)
        if (records->tasks[i].failed) return ca_fail_memory(error, "the camera paths");
    return CA_OK;
}

ca_status ca_camera_records_trace(ca_qmcppm *q, uint64_t first, uint64_t count, const ca_parallel *parallel,
                                  ca_worker *workers, ca_error *error)
{
    q->camera.first = first;
    return trace_tasks(q, 0, count, parallel, workers, error);
}

/* What tasks hold beside the records. */
static double bytes_of_tasks(const ca_camera_records *records, size_t first, size_t count)
{
    double bytes = 0.0;
    for (size_t i = first; i < first + count; i++)
        bytes += (double)(records->tasks[i].vertex_count * sizeof(ca_gather_vertex) +
                          records->tasks[i].density_count * sizeof(ca_path_vertex));
    return bytes;
}

double ca_camera_records_bytes(const ca_camera_records *records)
{
    return (double)records->count * sizeof *records->records + bytes_of_tasks(records, 0, task_count(records->count));
}

ca_status ca_camera_records_fill(ca_qmcppm *q, uint64_t first, double bytes, uint64_t *count,
                                 const ca_parallel *parallel, ca_worker *workers, ca_error *error)
{
    enum { STEP = FILL_TASKS * CA_CAMERA_TASK };
    double used = 0.0;
    q->camera.first = first;
    *count = 0;
    for (uint32_t task = 0; *count < UINT32_MAX - STEP; task += FILL_TASKS) {
        CA_TRY(trace_tasks(q, task, *count + STEP, parallel, workers, error));
        used += (double)STEP * sizeof *q->camera.records + bytes_of_tasks(&q->camera, task, FILL_TASKS);
        if (used > bytes && *count > 0) break;
        *count += STEP;
    }
    q->camera.count = *count;
    return CA_OK;
}

void ca_camera_records_destroy(ca_camera_records *records)
{
    for (size_t i = 0; i < records->task_count; i++) {
        ca_free(records->tasks[i].vertices);
        ca_free(records->tasks[i].densities);
    }
    ca_free(records->tasks);
    ca_free(records->records);
    *records = (ca_camera_records){0};
}
