/* Blocks of either side that stay in memory. See qmcppm.h. */
#include "integrator/qmcppm.h"

#include "base/memory.h"

#include <string.h>

/* Where no limit of memory was asked for. */
#define KEPT_BYTES_BY_DEFAULT 0x1p30

#define NO_BLOCK UINT64_MAX
#define NO_SLOT SIZE_MAX

/* ---- Either side ----------------------------------------------------------------------------------------------- */

/* Room for one slot more, which is not there yet. */
static ca_status grow(ca_kept_side *side, ca_error *error)
{
    ca_kept_block *slots = ca_array_grow(side->slots, &side->capacity, side->count + 1, sizeof *slots);
    if (!slots) return ca_fail_memory(error, "the blocks");
    side->slots = slots;
    side->slots[side->count] = (ca_kept_block){.number = NO_BLOCK};
    return CA_OK;
}

static size_t find(const ca_kept_side *side, uint64_t block)
{
    for (size_t i = 0; i < side->count; i++)
        if (side->slots[i].number == block) return i;
    return NO_SLOT;
}

/* The slot whose block may be overwritten. */
static size_t find_loose(const ca_kept_side *side)
{
    for (size_t i = 0; i < side->count; i++)
        if (!side->slots[i].stays) return i;
    return NO_SLOT;
}

static double light_bytes(const ca_kept_block *slot)
{
    return (double)ca_light_store_bytes(&slot->store) + (slot->grid ? (double)ca_photon_grid_bytes(slot->grid) : 0.0);
}

static double camera_bytes(const ca_kept_block *slot) { return ca_camera_records_held(&slot->camera); }

/* Is there room for so many bytes that stay, beside the two blocks that are in use? */
static bool has_room(const ca_qmcppm *q, double bytes)
{
    const double limit =
        q->input.memory_bytes > 0.0 ? q->input.memory_bytes - 2.0 * q->kept_blocks.largest : KEPT_BYTES_BY_DEFAULT;
    return q->kept_blocks.bytes + bytes <= limit;
}

/* The loose block stays too, if there is room. */
static void keep_loose(ca_qmcppm *q, ca_kept_side *side, double (*bytes_of)(const ca_kept_block *slot))
{
    const size_t loose = find_loose(side);
    if (loose == NO_SLOT || side->slots[loose].number == NO_BLOCK) return;
    const double bytes = bytes_of(&side->slots[loose]);
    if (bytes > q->kept_blocks.largest) q->kept_blocks.largest = bytes;
    if (!has_room(q, bytes)) return;
    side->slots[loose].stays = true;
    q->kept_blocks.bytes += bytes;
}

/* ---- Light paths ----------------------------------------------------------------------------------------------- */

/* From the engine into its slot, and the other way round. */
static void put_light(ca_qmcppm *q)
{
    ca_bidirectional *b = q->engine;
    ca_kept_block *slot = &q->kept_blocks.light.slots[q->kept_blocks.light.now];
    slot->store = b->store;
    slot->grid = b->grid;
    slot->photons = b->photons_now;
    slot->bytes = b->bytes_now;
    slot->paths = b->paths_now;
    slot->chunks = b->chunks_now;
    b->store = (ca_light_store){0};
    b->grid = NULL;
    q->kept_blocks.light.now = NO_SLOT;
}

static void take_light(ca_qmcppm *q, size_t number)
{
    ca_bidirectional *b = q->engine;
    ca_kept_block *slot = &q->kept_blocks.light.slots[number];
    b->store = slot->store;
    b->grid = slot->grid;
    b->photons_now = slot->photons;
    b->bytes_now = slot->bytes;
    b->paths_now = slot->paths;
    b->chunks_now = slot->chunks;
    slot->store = (ca_light_store){0};
    slot->grid = NULL;
    q->kept_blocks.light.now = number;
}

static ca_status add_light(ca_qmcppm *q, const ca_light_store *like, ca_error *error)
{
    ca_kept_side *side = &q->kept_blocks.light;
    CA_TRY(grow(side, error));
    ca_kept_block *slot = &side->slots[side->count];
    CA_TRY(ca_light_store_create(&slot->store, &like->layout, like->path_count, like->worker_count, error));
    side->count++; /* from here on it is destroyed with all others */
    return ca_bidirectional_merges(q->engine) ? ca_photon_grid_create(&slot->grid, error) : CA_OK;
}

ca_status ca_kept_light_change(ca_qmcppm *q, uint64_t block, bool *found, ca_error *error)
{
    ca_kept_side *side = &q->kept_blocks.light;
    const ca_light_store like = q->engine->store; /* what a new one is to be like */
    put_light(q);
    size_t slot = find(side, block);
    *found = slot != NO_SLOT;
    if (!*found) {
        keep_loose(q, side, light_bytes);
        slot = find_loose(side);
    }
    ca_status status = CA_OK;
    if (slot == NO_SLOT) {
        status = add_light(q, &like, error);
        slot = status == CA_OK ? side->count - 1 : 0; /* the engine is never without */
    }
    if (!*found && status == CA_OK) side->slots[slot].number = NO_BLOCK;
    take_light(q, slot);
    return status;
}

/* ---- Camera paths ---------------------------------------------------------------------------------------------- */

static void put_camera(ca_qmcppm *q)
{
    q->kept_blocks.camera.slots[q->kept_blocks.camera.now].camera = q->camera;
    q->camera = (ca_camera_records){0};
    q->kept_blocks.camera.now = NO_SLOT;
}

static void take_camera(ca_qmcppm *q, size_t slot)
{
    q->camera = q->kept_blocks.camera.slots[slot].camera;
    q->kept_blocks.camera.slots[slot].camera = (ca_camera_records){0};
    q->kept_blocks.camera.now = slot;
}

ca_status ca_kept_camera_change(ca_qmcppm *q, uint64_t block, bool *found, ca_error *error)
{
    ca_kept_side *side = &q->kept_blocks.camera;
    CA_TRY(grow(side, error));
    put_camera(q);
    size_t slot = find(side, block);
    *found = slot != NO_SLOT;
    if (!*found) {
        keep_loose(q, side, camera_bytes);
        slot = find_loose(side);
        if (slot == NO_SLOT) slot = side->count++;
        side->slots[slot].number = NO_BLOCK;
    }
    take_camera(q, slot);
    return CA_OK;
}

/* ---- Both ------------------------------------------------------------------------------------------------------ */

ca_status ca_kept_blocks_create(ca_qmcppm *q, ca_error *error)
{
    CA_TRY(grow(&q->kept_blocks.light, error));
    CA_TRY(grow(&q->kept_blocks.camera, error));
    q->kept_blocks.light.count = q->kept_blocks.camera.count = 1; /* those in use, empty yet */
    return CA_OK;
}

void ca_kept_blocks_done(ca_qmcppm *q, const ca_block_pair *pair)
{
    q->kept_blocks.light.slots[q->kept_blocks.light.now].number = pair->light;
    q->kept_blocks.camera.slots[q->kept_blocks.camera.now].number = pair->camera;
}

void ca_kept_blocks_destroy(ca_qmcppm *q)
{
    for (size_t i = 0; i < q->kept_blocks.light.count; i++) {
        ca_light_store_destroy(&q->kept_blocks.light.slots[i].store);
        ca_photon_grid_destroy(q->kept_blocks.light.slots[i].grid);
    }
    for (size_t i = 0; i < q->kept_blocks.camera.count; i++)
        ca_camera_records_destroy(&q->kept_blocks.camera.slots[i].camera);
    ca_free(q->kept_blocks.light.slots);
    ca_free(q->kept_blocks.camera.slots);
}
