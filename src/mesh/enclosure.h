/* How far a surface encloses what lies behind it, and how often it goes around a point. */
#ifndef VSHI_ENCLOSURE_H
#define VSHI_ENCLOSURE_H

#include "mesh/mesh.h"

#include <stdint.h>

/* Part of a mesh's triangles, some of them turned over, and triangles beside them. */
typedef struct vshi_surface_part {
    const vsh_mesh *mesh;
    const uint32_t *list; /* [count] */
    size_t count;
    const uint8_t *turned; /* of the mesh's triangles */
} vshi_surface_part;

/* World corners of a triangle that a part lists. */
void vshi_part_corners(const vshi_surface_part *part, size_t at, vshi_vec corner[3]);

/* Solid angle of a triangle seen from a point, -2π … 2π: positive from behind it. */
double vshi_solid_angle(const vshi_vec corner[3], vshi_vec point);

/* How often a part goes around a point: 1 inside of a closed surface, 0 outside of it; between them where it
 * is open, and 1/2 on it. */
double vshi_winding(const vshi_surface_part *part, vshi_vec point);

/* The point of a triangle that has a number: those of numbers that follow each other are spread over it. */
vshi_vec vshi_point_in(const vshi_vec corner[3], size_t number);

/* `count` points spread over a part by area. */
void vshi_part_samples(const vshi_surface_part *part, double area, size_t count, vshi_vec *samples);

/* How far a part with `cap_count` triangles over its holes encloses one of its sides: 1 where it is closed,
 * 1/2 for a plane. */
double vshi_part_encloses(const vshi_surface_part *part, double area, const vshi_vec (*caps)[3],
                          size_t cap_count);

#endif
