/* Camera paths of a block, traced once and kept: where they look for photons, and what they find without them. */
#include "integrator/qmcppm.h"

#include "base/memory.h"

#include <string.h>

/* Tasks of one step when records are filled into the memory. */
enum { FILL_TASKS = 32 };

/* ---- Vertices of a batch --------------------------------------------------------------------------------------- */

/* The paths of a task, which are traced together. */
typedef struct record_batch {
    const ca_qmcppm *q;
    ca_camera_task *task;
    ca_camera_record *records;
    ca_kept_vertices *kept; /* of the worker */
    uint32_t count, kept_count;
    uint32_t first[CA_CAMERA_TASK], last[CA_CAMERA_TASK]; /* of each path in `kept`, or CA_NONE */
    ca_camera_path paths[CA_CAMERA_TASK];
    ca_camera_walk *walks[CA_CAMERA_TASK];
} record_batch;

/* Was there a Dirac event before the last vertex? */
static bool met_dirac(const ca_camera_walk *walk)
{
    const uint32_t before = walk->walk.vertex - 1;
    return walk->walk.densities[before].connectable_count < before;
}

static bool shows_light(const ca_camera_walk *walk)
{
    const record_batch *batch = walk->user;
    return ca_qmcppm_shows(batch->q, met_dirac(walk));
}

static float initial_radius(const ca_qmcppm *q, ca_vec3 position)
{
    const float radius0 = q->engine->radius0;
    if (q->radius_photons == 0) return radius0;
    const float distance = ca_photon_grid_nearest(q->pilot, position, q->radius_photons);
    return ca_clamp(distance * q->pilot_scale, radius0 / CA_LOCAL_RADIUS_RANGE, radius0 * CA_LOCAL_RADIUS_RANGE);
}

static void ask_lights(const ca_qmcppm *q, ca_camera_walk *const *walks, uint32_t count)
{
    ca_camera_walk *shown[CA_CAMERA_TASK];
    uint32_t shown_count = 0;
    for (uint32_t i = 0; i < count; i++)
        if (ca_qmcppm_shows(q, met_dirac(walks[i]))) shown[shown_count++] = walks[i];
    ca_next_events(shown, shown_count, false);
}

/* Behind those of the same path. */
static void keep_vertex(record_batch *batch, const ca_camera_walk *walk)
{
    const uint32_t number = batch->kept_count++, slot = (uint32_t)(walk->path - batch->paths);
    ca_kept_vertex *items = batch->kept->items;
    items[number] = (ca_kept_vertex){.vertex = {.point = ca_vertex_point(&walk->walk.last),
                                                .wi = walk->walk.last.wi,
                                                .throughput = walk->walk.throughput,
                                                .radius0 = initial_radius(batch->q, walk->walk.last.position),
                                                .vertex = (uint16_t)walk->walk.vertex,
                                                .dirac = met_dirac(walk)},
                                     .next = CA_NONE};
    if (batch->first[slot] == CA_NONE)
        batch->first[slot] = number;
    else
        items[batch->last[slot]].next = number;
    batch->last[slot] = number;
}

/* Called with all paths of the batch that are still on their way. */
static void keep_vertices(ca_camera_walk *const *walks, uint32_t count)
{
    record_batch *batch = walks[0]->user;
    if (!batch->q->direct_photons) ask_lights(batch->q, walks, count);
    ca_kept_vertex *items =
        ca_array_grow(batch->kept->items, &batch->kept->capacity, batch->kept_count + count, sizeof *items);
    if (!items) {
        batch->task->failed = true;
        return;
    }
    batch->kept->items = items;
    for (uint32_t i = 0; i < count; i++)
        if (ca_vertex_is_smooth(&walks[i]->walk.last)) keep_vertex(batch, walks[i]);
}

/* ---- Records --------------------------------------------------------------------------------------------------- */

/* A path's vertices into its task, where there is room, next to each other. */
static void take_vertices(const record_batch *batch, uint32_t slot)
{
    ca_camera_task *task = batch->task;
    ca_camera_record *record = &batch->records[slot];
    record->first = (uint32_t)task->vertex_count;
    for (uint32_t i = batch->first[slot]; i != CA_NONE; i = batch->kept->items[i].next)
        task->vertices[task->vertex_count++] = batch->kept->items[i].vertex;
    record->count = (uint32_t)task->vertex_count - record->first;
}

static void take_densities(const record_batch *batch, uint32_t slot)
{
    ca_camera_task *task = batch->task;
    ca_camera_record *record = &batch->records[slot];
    const ca_walk *walk = &batch->walks[slot]->walk;
    record->densities = (uint32_t)task->density_count;
    if (!batch->q->weighted || record->count == 0) return;
    const uint32_t count = walk->vertex + 1;
    ca_path_vertex *densities =
        ca_array_grow(task->densities, &task->density_capacity, task->density_count + count, sizeof *densities);
    if (!densities) {
        task->failed = true;
        return;
    }
    task->densities = densities;
    memcpy(&task->densities[task->density_count], walk->densities, count * sizeof *task->densities);
    task->density_count += count;
}

static void fill_records(const record_batch *batch)
{
    ca_camera_task *task = batch->task;
    if (task->failed) return;
    ca_gather_vertex *vertices =
        ca_array_grow(task->vertices, &task->vertex_capacity, batch->kept_count, sizeof *vertices);
    if (!vertices) {
        task->failed = true;
        return;
    }
    task->vertices = vertices;
    for (uint32_t i = 0; i < batch->count; i++) {
        take_vertices(batch, i);
        take_densities(batch, i);
        batch->records[i].own_light = batch->walks[i]->light[0];
    }
}

/* ---- A block --------------------------------------------------------------------------------------------------- */

typedef struct trace_job {
    ca_qmcppm *q;
    ca_worker *workers;
    uint32_t first_task;
} trace_job;

/* Starts the batch's paths, the `number`-th and those after it. */
static void start_walks(record_batch *batch, uint64_t number, ca_worker *worker)
{
    static const ca_walk_hooks hooks = {.at_vertices = keep_vertices, .shows_light = shows_light};
    const ca_qmcppm *q = batch->q;
    const uint32_t *crop = q->input.crop, width = crop[2] - crop[0];
    for (uint32_t i = 0; i < batch->count; i++) {
        const uint64_t pixel = (number + i) % q->pixels;
        ca_camera_walk *walk = batch->walks[i] = &q->engine->scratch[worker->index].camera_walks[i];
        batch->records[i] = (ca_camera_record){0};
        batch->paths[i] = (ca_camera_path){.x = crop[0] + (uint32_t)(pixel % width),
                                           .y = crop[1] + (uint32_t)(pixel / width),
                                           .index = (uint32_t)((number + i) / q->pixels),
                                           .sample = &batch->records[i].sample};
        batch->first[i] = batch->last[i] = CA_NONE;
        ca_camera_walk_start(walk, q->engine, &batch->paths[i], i, worker);
        walk->hooks = &hooks;
        walk->user = batch;
    }
    worker->counters.camera_paths += batch->count;
}

static void trace_task(void *user, uint32_t index, uint32_t worker)
{
    const trace_job *job = user;
    const ca_qmcppm *q = job->q;
    const ca_camera_records *records = &q->camera;
    const uint64_t number = job->first_task + index, begin = number * CA_CAMERA_TASK, left = records->count - begin;
    record_batch batch;
    batch.q = q;
    batch.task = &records->tasks[number];
    batch.records = &records->records[begin];
    batch.kept = &q->kept[worker];
    batch.count = left < CA_CAMERA_TASK ? (uint32_t)left : CA_CAMERA_TASK;
    batch.kept_count = 0;
    batch.task->vertex_count = batch.task->density_count = 0;
    batch.task->failed = false;
    start_walks(&batch, records->first + begin, &job->workers[worker]);
    if (q->engine->max_depth > 0) ca_camera_walks_trace(batch.walks, batch.count);
    fill_records(&batch);
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
    CA_TRY(ca_parallel_for(parallel, (uint32_t)(tasks - first_task), trace_task, &job, error));
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

double ca_camera_records_held(const ca_camera_records *records)
{
    double bytes = (double)records->record_capacity * sizeof *records->records +
                   (double)records->task_capacity * sizeof *records->tasks;
    for (size_t i = 0; i < records->task_count; i++)
        bytes += (double)(records->tasks[i].vertex_capacity * sizeof(ca_gather_vertex) +
                          records->tasks[i].density_capacity * sizeof(ca_path_vertex));
    return bytes;
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
