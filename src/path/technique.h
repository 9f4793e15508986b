/* The ways in which a camera path of s vertices and a light path of t vertices make a full path.
 *
 * A full path has the vertices x[0] (on the lens) to x[n-1] (on the light), n - 1 segments. Vertices counted by s and
 * t include both ends. */
#ifndef CA_PATH_TECHNIQUE_H
#define CA_PATH_TECHNIQUE_H

typedef enum ca_technique {
    CA_TECHNIQUE_HIT,        /* t = 0: the camera path runs into the light */
    CA_TECHNIQUE_NEXT_EVENT, /* t = 1: a point of the light is chosen for the camera path's last vertex */
    CA_TECHNIQUE_CONNECT,    /* s >= 2, t >= 2: an edge between the two last vertices */
    CA_TECHNIQUE_SPLAT,      /* s = 1: a point of the lens is chosen for the light path's last vertex */
    CA_TECHNIQUE_MERGE,      /* the two last vertices are closer than the radius and taken for one: n = s + t - 1 */
    CA_TECHNIQUE_COUNT
} ca_technique;

/* "hit", "next_event", "connect", "splat", "merge". */
const char *ca_technique_name(ca_technique technique);

#endif
