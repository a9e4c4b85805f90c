/* Hermitian systems over the edges of a mesh: a complex unknown at each vertex. */
#ifndef VSHI_UNWRAP_SPARSE_H
#define VSHI_UNWRAP_SPARSE_H

#include "base/error.h"
#include "base/vec.h"

#include <complex.h>
#include <stdint.h>

/* The product: that of the language looks for numbers that are none. */
static inline double complex vshi_times(double complex a, double complex b) {
    return CMPLX(creal(a) * creal(b) - cimag(a) * cimag(b), creal(a) * cimag(b) + cimag(a) * creal(b));
}

/* Rows and columns stand in the order in which they are eliminated. */
typedef struct vshi_sparse {
    uint32_t count;
    uint32_t *order;  /* [count]: the row of each vertex */
    uint32_t *begin;  /* [count + 1] in `column`: entries of each row left of the diagonal */
    uint32_t *column; /* ascending in each row */
    double complex *value;
    double *diagonal;
    uint32_t *parent;       /* of the elimination tree */
    uint32_t *factor_begin; /* [count + 1] in `factor_row`: entries of each column of the factor */
    uint32_t *factor_row;
    double complex *factor;
    double *pivot;
    double complex *work;
    uint32_t *marks, *stack, *filled;
} vshi_sparse;

/* A system whose entries are the edges of triangles[count][3] with `vertex_count` vertices at `place`; all
 * values are 0. Errors: VSH_ERROR_MEMORY. Free with vshi_sparse_free(), after a failure too. */
vsh_result vshi_sparse_make(const uint32_t (*triangles)[3], uint32_t count, const vshi_vec *place,
                            uint32_t vertex_count, vshi_sparse *system, vsh_error *error);
void vshi_sparse_free(vshi_sparse *system);

void vshi_sparse_clear(vshi_sparse *system);

/* Adds to the entry of row a, column b, and the conjugate to its mirror image; a and b are an edge's
 * vertices. */
void vshi_sparse_add(vshi_sparse *system, uint32_t a, uint32_t b, double complex value);
void vshi_sparse_add_diagonal(vshi_sparse *system, uint32_t vertex, double value);

/* Fixes a vertex at a value: its row becomes that of the identity, and what others have of it goes to their
 * right sides. Before the factoring. */
void vshi_sparse_pin(vshi_sparse *system, uint32_t vertex, double complex value, double complex *right);

/* False where the matrix is not positive definite, as far as doubles tell. */
bool vshi_sparse_factor(vshi_sparse *system);

/* Solves for one right side [count], by vertex, in place. */
void vshi_sparse_solve(const vshi_sparse *system, double complex *right);

#endif
