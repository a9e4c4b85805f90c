/* A floor under a ball, in files of this run's folder. */
#pragma once

#include "images.h"

typedef struct case_scene {
    char mesh[300], output[300];
    vsh_sdf_node ball;
    vsh_caster caster;
    vsh_light sun;
    vsh_receiver receiver;
    vsh_scene scene;
} case_scene;

/* The floor has 4 × 4 units and `size` texels a side; the ball's middle is `height` above it, its radius 0.6.
 */
static inline void fill(case_scene *c, int32_t size, double height) {
    memset(c, 0, sizeof *c);
    snprintf(c->mesh, sizeof c->mesh, "%s", at("floor.obj"));
    snprintf(c->output, sizeof c->output, "%s", at("floor.exr"));
    write_string(c->mesh, "v -2 0 -2\nvt 0 1\nv 2 0 -2\nvt 1 1\nv 2 0 2\nvt 1 0\nv -2 0 2\nvt 0 0\n"
                          "f 1/1 3/3 2/2\nf 1/1 4/4 3/3\n");
    c->scene = vsh_scene_default();
    c->receiver = vsh_receiver_default();
    c->ball = vsh_sdf_node_default();
    c->ball.radius = 0.6;
    c->caster.type = VSH_CASTER_SDF;
    c->caster.sdf = (vsh_sdf){&c->ball, 1};
    for (int i = 0; i < 12; ++i) {
        c->caster.transform[i] = c->receiver.transform[i] = i % 5 == 0 ? 1.0 : 0.0;
    }
    c->caster.transform[7] = height;
    c->sun = vsh_light_default();
    c->sun.angle = 0.1;
    c->receiver.path = c->mesh;
    c->receiver.output = c->output;
    c->receiver.width = c->receiver.height = size;
    c->receiver.ao_spacing = 1;
    c->scene.casters = &c->caster;
    c->scene.caster_count = 1;
    c->scene.lights = &c->sun;
    c->scene.light_count = 1;
    c->scene.receivers = &c->receiver;
    c->scene.receiver_count = 1;
    c->scene.ao = c->scene.irradiance = 1;
    c->scene.grid.resolution = 24;
    c->scene.shade.method = VSH_SHADOW_CONE;
    c->scene.shade.ao_method = VSH_AO_CONES;
    c->scene.shade.ao_distance = 1.0;
}
