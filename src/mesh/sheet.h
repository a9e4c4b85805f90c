/* Triangles that hang together, and whether they cut a beam of rays. */
#ifndef VSHI_SHEET_H
#define VSHI_SHEET_H

#include "base/error.h"
#include "base/vec.h"

#include <stdint.h>
#include <vdbshade/mesh.h>

#define VSHI_SHEET_BORDER UINT32_MAX

typedef struct vshi_sheet {
    size_t vertex_count;
    size_t triangle_count;
    float *vertices;      /* [vertex_count][3], within 1 of the origin */
    uint32_t *corners;    /* [triangle_count][3]: vertices */
    uint32_t *neighbours; /* [triangle_count][3]: triangle across the edge from corner k to k + 1, or
                           * VSHI_SHEET_BORDER where not exactly two triangles meet */
} vshi_sheet;

/* A beam: all rays from a ball of `wide` around the origin, whose directions have at most `tangent` to the
 * unit axis, as far as `end` along it. */
typedef struct vshi_sheet_beam {
    vshi_vec origin;
    vshi_vec axis;
    double wide;
    double tangent; /* ≥ 0 */
    double end;     /* may be infinite */
} vshi_sheet_beam;

/* Takes `vertex_count` vertices and `triangle_count` triangles (at most VSHI_SHEET_TRIANGLES), to be filled
 * by the caller; vshi_sheet_join() finds the neighbours afterwards. Errors: VSH_ERROR_MEMORY. */
#define VSHI_SHEET_TRIANGLES (UINT32_MAX / 3) /* their edges are numbered */
vsh_result vshi_sheet_allocate(vshi_sheet *sheet, size_t vertex_count, size_t triangle_count,
                               vsh_error *error);
vsh_result vshi_sheet_join(vshi_sheet *sheet, vsh_error *error);
void vshi_sheet_free(vshi_sheet *sheet);
double vshi_sheet_bytes(double vertex_count, double triangle_count);

/* Whether the triangles that hang together with `triangle`, which the axis meets at `distance`, cut the beam,
 * so that each of its rays meets one. Looks at no more than `most` triangles (at most VSHI_SHEET_MOST). False
 * where it cannot tell. */
enum { VSHI_SHEET_MOST = 128 };
bool vshi_sheet_cuts(const vshi_sheet *sheet, const vshi_sheet_beam *beam, uint32_t triangle, double distance,
                     int most);

#endif
