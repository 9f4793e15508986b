/* Lenses as tables, one surface a row from the scene to the film, in mm.
 *
 * Without a header a row is four numbers, as in pbrt's lens files: radius of curvature, thickness to the next
 * surface, index of refraction behind the surface, diameter of the aperture. Published tables have a header that
 * names their columns, in any order:
 *     radius, thickness, diameter
 *     index    behind the surface; "air" or no entry: 1
 *     glass    instead of it: a code of six digits, nd - 1 and the Abbe number, such as 517642 or 517-642, or a name
 *              (lens_glass.h)
 *     abbe     the Abbe number, of no consequence: there is no dispersion
 *     surface  a name or number, of no consequence
 * "-" stands for no entry, and so do columns that a row has not reached. A radius "inf" is a plane, 0 or "stop" a
 * stop, which does not refract. # begins a comment; a row ends with its line or at a semicolon. */
#ifndef CA_IMPORT_LENS_TABLE_H
#define CA_IMPORT_LENS_TABLE_H

#include "base/status.h"
#include "camera/lens.h"

typedef struct ca_lens_table {
    ca_lens lens;
    uint32_t stop, stop_count; /* the last stop, and how many there are */
} ca_lens_table;

/* `where`: of a text in an attribute, the element to blame; its file is not read then. NULL: lines and columns of
 * `file` are. The lens has at least one surface and all of it is possible: apertures within their spheres, indices
 * from 1 to 5, air behind the last surface. */
ca_status ca_import_lens(const char *file, const char *text, size_t size, const ca_location *where,
                         ca_lens_table *table, ca_error *error);

#endif
