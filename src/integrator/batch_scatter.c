/* From vertices to the next segments: sampled directions, roulette, and the paths that go on closed up. */
#include "integrator/batch.h"
#include "integrator/batch_lanes.h"
#include "integrator/walk.h"

/* What sampling gives each place; go_on: all bits, or 0 where the path ends. */
typedef struct event_batch {
    ca_column3 direction, origin, throughput, receiver_normal;
    _Alignas(32) float pdf[CA_COLUMN];
    float eta2[CA_COLUMN];
    uint32_t dirac[CA_COLUMN], go_on[CA_COLUMN];
} event_batch;

/* sample_diffuse of material/bsdf.c. */
static void scatter_matte(const ca_batch *batch, const ca_number_batch *u, event_batch *events, uint32_t i)
{
    const ca_vertex_batch *v = &batch->vertices;
    const ca_v8 n = ca_column3_load(&v->ns, i), wi = ca_column3_load(&v->wi, i);
    const ca_f8 side = ca_load8(v->side, i), grazing = ca_f8_all(CA_GRAZING_COS);
    const ca_f8 cos_i = ca_dot_v8(n, wi) * side;
    ca_v8 local = ca_cosine_hemisphere8(ca_load8(u->x, i), ca_load8(u->y, i));
    const ca_f8 cos_local = local.z;
    local.z = local.z * side;
    const ca_v8 wo = ca_to_world8(n, local);
    const ca_f8 cos_o = ca_dot_v8(n, wo) * side;
    const ca_m8 leaves = (cos_i > grazing) & (cos_local > grazing) & (cos_o > grazing);
    ca_store8_u32(events->go_on, i, ca_load8_u32(v->matte, i) & leaves);
    ca_column3_store(&events->direction, i, wo);
    ca_column3_store(&events->receiver_normal, i, ca_select_v8(ca_dot_v8(n, wi) < 0.0f, ca_neg_v8(n), n));
    const ca_v8 position = ca_column3_load(&v->position, i);
    ca_column3_store(&events->origin, i, ca_offset_origin8(position, ca_load8(v->error, i), n, wo));
    const ca_v8 throughput = ca_column3_load(&batch->throughput, i), f = ca_column3_load(&v->reflectance, i);
    ca_column3_store(&events->throughput, i,
                     (ca_v8){throughput.x * f.x, throughput.y * f.y, throughput.z * f.z});
    ca_store8(events->pdf, i, cos_local * ca_f8_all(CA_INV_PI));
    ca_store8(events->eta2, i, ca_load8(batch->eta2, i));
    ca_store8_u32(events->dirac, i, ca_m8_all(0));
}

static void scatter_one(const ca_batch *batch, float u_lobe, ca_vec2 u, event_batch *events, uint32_t i)
{
    const ca_vertex_batch *v = &batch->vertices;
    const ca_surface *surface = &v->surfaces[i];
    ca_bsdf_sample event;
    if (!ca_bsdf_sample_direction(&v->bsdfs[i], ca_column3_at(&v->wi, i), u_lobe, u, CA_FROM_CAMERA, &event)) {
        events->go_on[i] = 0;
        return;
    }
    events->go_on[i] = UINT32_MAX;
    ca_column3_set(&events->direction, i, event.wo_world);
    ca_column3_set(
        &events->receiver_normal, i,
        ca_receiver_at(surface->position, surface->ng, ca_column3_at(&v->wi, i), v->bsdfs[i].scatter).normal);
    ca_column3_set(&events->origin, i,
                   ca_offset_origin(surface->position, surface->position_error, surface->ng, event.wo_world));
    events->throughput.x[i] = batch->throughput.x[i] * event.weight.r;
    events->throughput.y[i] = batch->throughput.y[i] * event.weight.g;
    events->throughput.z[i] = batch->throughput.z[i] * event.weight.b;
    events->pdf[i] = event.pdf.v;
    events->eta2[i] = batch->eta2[i] * ca_sqr(event.eta);
    events->dirac[i] = event.scatter & CA_SCATTER_DIRAC ? UINT32_MAX : 0;
}

/* survives of walk.c, eight at a time: which paths go on. */
static ca_m8 play_roulette(const ca_number_batch *u, bool plays, event_batch *events, uint32_t i)
{
    const ca_v8 t = ca_column3_load(&events->throughput, i);
    const ca_f8 largest = ca_max3_v8(t);
    ca_m8 go_on = ca_load8_u32(events->go_on, i) & (largest > 0.0f);
    if (plays) {
        const ca_f8 left = CA_ROULETTE_GAIN * largest * ca_load8(events->eta2, i);
        const ca_f8 survival = ca_min8(ca_f8_all(CA_ROULETTE_MOST), left);
        go_on &= ~(ca_load8(u->y, i) >= survival);
        ca_column3_store(&events->throughput, i, ca_mul_v8(t, 1.0f / survival));
    }
    return go_on;
}

static void move(float *to, const float *from, ca_m8 places)
{
    ca_store8_anywhere(to, ca_permute8(ca_load8(from, 0), places));
}

static void move_u32(uint32_t *to, const uint32_t *from, ca_m8 places)
{
    move((float *)(void *)to, (const float *)(const void *)from, places);
}

static void move3(ca_column3 *to, uint32_t i, const ca_column3 *from, uint32_t k, ca_m8 places)
{
    ca_column3_store_anywhere(to, i, ca_permute_v8(ca_column3_load(from, k), places));
}

/* Of the eight paths from `from` on those at `places` close up behind the `to` paths that have gone on. Writes eight
 * paths, but none beyond the eight that it has read. */
static void move_on(ca_batch *batch, const event_batch *events, uint32_t from, uint32_t to, ca_m8 places)
{
    move3(&batch->rays.origin, to, &events->origin, from, places);
    move3(&batch->rays.direction, to, &events->direction, from, places);
    move3(&batch->throughput, to, &events->throughput, from, places);
    move3(&batch->previous, to, &batch->vertices.position, from, places);
    move3(&batch->previous_normal, to, &events->receiver_normal, from, places);
    ca_store8_anywhere(batch->rays.t_min + to, ca_f8_all(0.0f));
    ca_store8_anywhere(batch->rays.t_max + to, ca_f8_all(INFINITY));
    move(batch->eta2 + to, events->eta2 + from, places);
    move(batch->pdf + to, events->pdf + from, places);
    move_u32(batch->dirac + to, events->dirac + from, places);
    move_u32(batch->key_low + to, batch->key_low + from, places);
    move_u32(batch->key_high + to, batch->key_high + from, places);
    move_u32(batch->slot + to, batch->slot + from, places);
}

void ca_batch_scatter(ca_batch *batch, uint32_t rr_depth)
{
    event_batch events;
    const uint32_t dimension = ca_vertex_dimension(batch->segments - 1);
    ca_number_batch *u = &batch->numbers[0], *u_lobe_roulette = &batch->numbers[1];
    ca_batch_sample_2d(batch, dimension + CA_DIM_BSDF_DIRECTION, u);
    ca_batch_sample_2d(batch, dimension + CA_DIM_BSDF_LOBE, u_lobe_roulette);
    for (uint32_t i = 0; i < batch->count; i += CA_LANES) scatter_matte(batch, u, &events, i);
    for (uint32_t i = 0; i < batch->count; i++)
        if (!batch->vertices.matte[i] && !ca_batch_left(batch, i))
            scatter_one(batch, u_lobe_roulette->x[i], (ca_vec2){u->x[i], u->y[i]}, &events, i);
    uint32_t kept = 0;
    for (uint32_t i = 0; i < batch->count; i += CA_LANES) {
        const ca_m8 go_on = play_roulette(u_lobe_roulette, batch->segments >= rr_depth, &events, i);
        const uint32_t bits = ca_mask_bits_below(go_on, batch->count - i);
        move_on(batch, &events, i, kept, ca_places_of_bits(bits));
        kept += (uint32_t)__builtin_popcount(bits);
    }
    batch->count = kept;
}
