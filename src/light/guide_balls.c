#include "light/guide_balls.h"

/* All points, and those of a cluster, are so many at least: fewer say too little of where they end. */
enum { LEAST_OF_ALL = 8, LEAST_POINTS = 24 };

typedef struct cluster {
    ca_guide_sample *points;
    size_t count;
    double weight;
    ca_vec3 low, high;
    bool is_final; /* it is not cut again */
} cluster;

static cluster make_cluster(ca_guide_sample *points, size_t count)
{
    cluster c = {
        .points = points, .count = count, .low = points[0].position, .high = points[0].position,
        .is_final = count < (size_t)2 * LEAST_POINTS};
    for (size_t i = 0; i < count; i++) {
        c.weight += (double)points[i].weight;
        c.low = ca_min_vec3(c.low, points[i].position);
        c.high = ca_max_vec3(c.high, points[i].position);
    }
    return c;
}

static float coordinate(ca_vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

static int longest_axis(ca_vec3 extent)
{
    const float most = ca_max3(extent);
    return extent.x >= most ? 0 : extent.y >= most ? 1 : 2;
}

/* Points below the mean first; returns how many they are. */
static size_t partition(const cluster *c, int axis)
{
    double sum = 0.0;
    size_t below = 0;
    for (size_t i = 0; i < c->count; i++) sum += (double)coordinate(c->points[i].position, axis);
    const float mean = (float)(sum / (double)c->count);
    for (size_t i = 0; i < c->count; i++) {
        if (!(coordinate(c->points[i].position, axis) < mean)) continue;
        const ca_guide_sample point = c->points[i];
        c->points[i] = c->points[below];
        c->points[below++] = point;
    }
    return below;
}

/* Cuts the cluster across its longest side; false where one of the parts would be too small. */
static bool cut(cluster *c, cluster *other)
{
    const size_t below = partition(c, longest_axis(ca_sub(c->high, c->low)));
    if (below < LEAST_POINTS || c->count - below < LEAST_POINTS) return false;
    *other = make_cluster(c->points + below, c->count - below);
    *c = make_cluster(c->points, below);
    return true;
}

/* The one whose cut promises most: much light over a wide area. NULL: none is left. */
static cluster *widest(cluster *clusters, uint32_t count)
{
    cluster *best = NULL;
    double most = 0.0;
    for (uint32_t i = 0; i < count; i++) {
        const double size = clusters[i].weight * (double)ca_length2(ca_sub(clusters[i].high, clusters[i].low));
        if (clusters[i].is_final || size <= most) continue;
        best = &clusters[i];
        most = size;
    }
    return best;
}

/* The points of a finite sample lie within the true outline: the ball is a little wider. */
static ca_guide_ball ball_around(const cluster *c, double all, float least_radius)
{
    const ca_vec3 center = ca_mul(ca_add(c->low, c->high), 0.5f);
    float radius2 = 0.0f;
    for (size_t i = 0; i < c->count; i++)
        radius2 = ca_max(radius2, ca_length2(ca_sub(c->points[i].position, center)));
    const float wider = 1.0f + 1.0f / sqrtf((float)c->count);
    return (ca_guide_ball){.center = center,
                           .radius = ca_max(wider * sqrtf(radius2), least_radius),
                           .density = (float)(c->weight / all)};
}

uint32_t ca_guide_balls(ca_guide_sample *points, size_t count, float least_radius,
                        ca_guide_ball balls[CA_GUIDE_MOST_BALLS])
{
    cluster clusters[CA_GUIDE_MOST_BALLS - 1], *next;
    uint32_t cluster_count = 1;
    if (count < LEAST_OF_ALL) return 0;
    clusters[0] = make_cluster(points, count);
    const double all = clusters[0].weight;
    if (!(all > 0.0)) return 0; /* weights that are too small for floats */
    balls[0] = ball_around(&clusters[0], all, least_radius);
    while (cluster_count < CA_GUIDE_MOST_BALLS - 1 && (next = widest(clusters, cluster_count))) {
        if (cut(next, &clusters[cluster_count]))
            cluster_count++;
        else
            next->is_final = true;
    }
    for (uint32_t i = 0; i < cluster_count; i++) balls[i + 1] = ball_around(&clusters[i], all, least_radius);
    return cluster_count + 1;
}
