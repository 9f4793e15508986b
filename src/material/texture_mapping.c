#include "material/texture_mapping.h"

#include "math/arc_tangent.h"
#include "math/numeric.h"

#define INV_2PI (0.5f * CA_INV_PI)

static float distance_from_z(ca_vec3 q) { return sqrtf(q.x * q.x + q.y * q.y); }

ca_vec2 ca_texture_mapping_at(ca_texture_mapping mapping, ca_vec3 q)
{
    if (mapping == CA_MAPPING_PLANAR) return (ca_vec2){q.x, q.y};
    const float phi = ca_atan2(q.y, q.x);
    if (mapping == CA_MAPPING_CYLINDRICAL) return (ca_vec2){(CA_PI + phi) * INV_2PI, q.z};
    const float theta = ca_atan2(distance_from_z(q), q.z);
    return (ca_vec2){theta * CA_INV_PI, (phi < 0.0f ? phi + 2.0f * CA_PI : phi) * INV_2PI};
}

ca_vec2 ca_texture_mapping_slope(ca_texture_mapping mapping, ca_vec3 q, ca_vec3 d)
{
    if (mapping == CA_MAPPING_PLANAR) return (ca_vec2){d.x, d.y};
    const float r = distance_from_z(q);
    const float around = r > 0.0f ? (q.x * d.y - q.y * d.x) / (r * r) : 0.0f;
    if (mapping == CA_MAPPING_CYLINDRICAL) return (ca_vec2){around * INV_2PI, d.z};
    const float outwards = r > 0.0f ? (q.x * d.x + q.y * d.y) / r : 0.0f;
    const float down = r > 0.0f ? (q.z * outwards - r * d.z) / (r * r + q.z * q.z) : 0.0f;
    return (ca_vec2){down * CA_INV_PI, around * INV_2PI};
}
