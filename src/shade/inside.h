/* Which points lie inside solids or behind walls, by rays against the triangles that bound them. */
#ifndef VSHI_INSIDE_H
#define VSHI_INSIDE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <vdbshade/trace.h>

enum { VSHI_OUTSIDE = 0, VSHI_INSIDE = 1 };

/* Whether something else knows that point `i` is in the open; asked only where a few rays do not tell. */
typedef bool vshi_open_fn(const void *user, size_t i);

/* Looks at `count` points [count][3] on surfaces, a hair above them along their normals [count][3] (unit;
 * zero: any will do), into where[count]. `open` may be NULL. follows[count]: whether a point is next to the
 * one before it on a surface; where no triangle parts the two, what is said of that one is said of both.
 * NULL: what is said of a point depends on nothing but the point. Thread safe. */
void vshi_inside(const vsh_triangles *triangles, size_t count, const double *positions, const float *normals,
                 const bool *follows, vshi_open_fn *open, const void *user, uint8_t *where);

#endif
