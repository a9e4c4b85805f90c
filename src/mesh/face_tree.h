/* Faces of many components in a tree of boxes, and which of them a segment crosses. */
#ifndef VSHI_FACE_TREE_H
#define VSHI_FACE_TREE_H

#include "base/error.h"
#include "base/vec.h"

#include <stdint.h>

/* A triangle, numbered by who made the tree: it knows the corners. */
typedef struct vshi_face {
    uint32_t component, number;
} vshi_face;

typedef void vshi_face_corners_fn(const void *user, vshi_face face, vshi_vec corner[3]);

typedef struct vshi_face_tree vshi_face_tree;

/* Sorts `faces` [count], which stay the caller's and must live as long as the tree. Errors: VSH_ERROR_MEMORY.
 * Free the result with vshi_face_tree_free(). */
vsh_result vshi_face_tree_create(vshi_face *faces, size_t count, vshi_face_corners_fn *corners,
                                 const void *user, vshi_face_tree **made, vsh_error *error);
void vshi_face_tree_free(vshi_face_tree *tree); /* NULL does nothing */

/* Where a segment goes through a face. */
typedef struct vshi_face_crossing {
    double at; /* 0 … 1 along it */
    uint32_t component;
    int32_t out; /* 1: from behind the face to its front, -1: the other way */
} vshi_face_crossing;

/* The crossings of the segment from `from` to `to` in their order, `most` at most; returns how many. */
size_t vshi_face_tree_cross(const vshi_face_tree *tree, vshi_vec from, vshi_vec to,
                            vshi_face_crossing *crossings, size_t most);

#endif
