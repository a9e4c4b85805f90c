#include "bake/page.h"

#include "shade/ao.h"

/* Turns a direction to tangent space: the sample's own axes. */
static void turn_to_tangent(const float *normal, const float *given, float *bent) {
    const vshi_vec n = vshi_unit(vshi_vec_off(normal));
    vshi_vec t = vshi_vec_off(given), b;
    t = vshi_sub(t, vshi_scale(n, vshi_dot(n, t)));
    if (!(vshi_dot(t, t) > 0.0)) {
        vshi_frame(n, &t, &b);
    }
    t = vshi_unit(t);
    b = vshi_scale(vshi_cross(n, t), (double)given[3]);
    const vshi_vec d = vshi_vec_off(bent);
    bent[0] = (float)vshi_dot(d, t);
    bent[1] = (float)vshi_dot(d, b);
    bent[2] = (float)vshi_dot(d, n);
}

void vshi_bent_normal(const float *normal, const float *tangent, float *bent) {
    vshi_ao_bent(bent, normal);
    if (tangent != NULL) {
        turn_to_tangent(normal, tangent, bent);
    }
}

void vshi_bent_normalize(float *bent) {
    const vshi_vec d = vshi_unit(vshi_vec_off(bent));
    bent[0] = (float)d.x;
    bent[1] = (float)d.y;
    bent[2] = (float)d.z;
}
