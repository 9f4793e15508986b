/* BSDFs: every parameter in its field, every default the documented one. */
#include "support/import_text.h"

#include <math.h>

#include "material/conductor_data.h"

static ca_scene_desc desc;

/* The last material is the outermost one of the text's last BSDF. */
static const ca_material *import(const char *text)
{
    import_text(&desc, text, NULL, 0);
    return &desc.materials.items[desc.materials.count - 1].material;
}

static void done(void) { ca_scene_desc_destroy(&desc); }

static void near(double actual, double expected)
{
    if (!(fabs(actual - expected) <= 1e-6 * fmax(1.0, fabs(expected))))
        fail_msg("%.9g, expected %.9g", actual, expected);
}

static void is_rgb(ca_texture_id id, double r, double g, double b)
{
    assert_true(id < desc.textures.count);
    assert_int_equal(desc.textures.items[id].kind, CA_TEXTURE_CONSTANT);
    const ca_rgb c = desc.textures.items[id].as.constant;
    near((double)c.r, r);
    near((double)c.g, g);
    near((double)c.b, b);
}

static void is_grey(ca_texture_id id, double value) { is_rgb(id, value, value, value); }

static void dielectrics(void **state)
{
    (void)state;
    const ca_material *m = import(SCENE("\n  <bsdf type=\"dielectric\" id=\"glass\"/>"));
    assert_int_equal(m->kind, CA_MATERIAL_DIELECTRIC);
    near((double)m->as.dielectric.eta, 1.5046 / 1.000277);
    is_grey(m->as.dielectric.reflectance, 1.0);
    is_grey(m->as.dielectric.transmittance, 1.0);
    assert_string_equal(desc.materials.items[0].id, "glass");
    assert_int_equal(desc.materials.items[0].where.line, 3);
    assert_int_equal(desc.materials.items[0].where.column, 3);
    done();
    m = import(
        SCENE("<bsdf type=\"thindielectric\"><string name=\"int_ior\" value=\"Water\"/>"
              "<float name=\"ext_ior\" value=\"1\"/><rgb name=\"specular_transmittance\" value=\"0.1 0.2 0.3\"/>"
              "<rgb name=\"specular_reflectance\" value=\"0.4\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_THIN_DIELECTRIC);
    near((double)m->as.thin_dielectric.eta, 1.333);
    is_rgb(m->as.thin_dielectric.transmittance, 0.1, 0.2, 0.3);
    is_grey(m->as.thin_dielectric.reflectance, 0.4);
    done();
    m = import(SCENE("<bsdf type=\"roughdielectric\"><string name=\"int_ior\" value=\"diamond\"/>"
                     "<string name=\"ext_ior\" value=\"vacuum\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_ROUGH_DIELECTRIC);
    near((double)m->as.rough_dielectric.eta, 2.419);
    assert_int_equal(m->as.rough_dielectric.facets.distribution, CA_MICROFACET_BECKMANN);
    assert_true(m->as.rough_dielectric.facets.sample_visible);
    is_grey(m->as.rough_dielectric.facets.alpha_u, 0.1);
    assert_int_equal(m->as.rough_dielectric.facets.alpha_u, m->as.rough_dielectric.facets.alpha_v);
    done();
}

static void conductors(void **state)
{
    (void)state;
    const ca_material *m = import(SCENE("<bsdf type=\"conductor\"/>"));
    assert_int_equal(m->kind, CA_MATERIAL_CONDUCTOR);
    is_grey(m->as.conductor.eta, 0.0);
    is_grey(m->as.conductor.k, 1.0);
    is_grey(m->as.conductor.reflectance, 1.0);
    done();
    m = import(
        SCENE("<bsdf type=\"roughconductor\"><string name=\"material\" value=\"Au\"/>"
              "<string name=\"distribution\" value=\"ggx\"/><float name=\"alpha_u\" value=\"0.2\"/>"
              "<float name=\"alpha_v\" value=\"0.3\"/><boolean name=\"sample_visible\" value=\"false\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_ROUGH_CONDUCTOR);
    is_rgb(m->as.rough_conductor.eta, 0.143119, 0.374957, 1.44248);
    is_rgb(m->as.rough_conductor.k, 3.98316, 2.38572, 1.60322);
    assert_int_equal(m->as.rough_conductor.facets.distribution, CA_MICROFACET_GGX);
    assert_false(m->as.rough_conductor.facets.sample_visible);
    is_grey(m->as.rough_conductor.facets.alpha_u, 0.2);
    is_grey(m->as.rough_conductor.facets.alpha_v, 0.3);
    done();
    m = import(SCENE("<bsdf type=\"roughconductor\"><rgb name=\"eta\" value=\"1 2 3\"/>"
                     "<spectrum name=\"k\" value=\"300:4, 900:4\"/>"
                     "<texture name=\"alpha\" type=\"checkerboard\"/></bsdf>"));
    is_rgb(m->as.rough_conductor.eta, 1.0, 2.0, 3.0);
    is_grey(m->as.rough_conductor.k, 4.0);
    assert_int_equal(desc.textures.items[m->as.rough_conductor.facets.alpha_u].kind, CA_TEXTURE_CHECKERBOARD);
    done();
    m = import(SCENE("<bsdf type=\"conductor\"><string name=\"material\" value=\"Ag\"/>"
                     "<float name=\"ext_eta\" value=\"2\"/></bsdf>"));
    is_rgb(m->as.conductor.eta, 0.155265 / 2, 0.116723 / 2, 0.138381 / 2);
    done();
}

/* No name twice, nothing negative, and the names that Mitsuba documents. */
static void conductor_table_is_sound(void **state)
{
    (void)state;
    size_t count;
    const ca_conductor *table = ca_conductor_table(&count);
    assert_int_equal(count, 70);
    for (size_t i = 0; i < count; i++) {
        assert_ptr_equal(ca_conductor_find(table[i].name), &table[i]);
        const float smallest = fminf(fminf(table[i].k.r, fminf(table[i].k.g, table[i].k.b)),
                                     fminf(table[i].eta.r, fminf(table[i].eta.g, table[i].eta.b)));
        assert_true(smallest >= 0.0f);
    }
    static const char *const known[] = {"a-C",  "Ag",       "Al",      "AlAs",     "Au",      "Be",   "Cr",
                                        "Cu",   "Cu_palik", "d-C",     "Hg",       "K",       "TiO2", "W",
                                        "none", "VN",       "V_palik", "Na_palik", "Ni_palik"};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) assert_non_null(ca_conductor_find(known[i]));
    assert_null(ca_conductor_find("Unobtainium"));
}

static void plastics(void **state)
{
    (void)state;
    const ca_material *m = import(SCENE("<bsdf type=\"plastic\"/>"));
    assert_int_equal(m->kind, CA_MATERIAL_PLASTIC);
    near((double)m->as.plastic.eta, 1.49 / 1.000277);
    is_grey(m->as.plastic.diffuse, 0.5);
    is_grey(m->as.plastic.specular, 1.0);
    assert_false(m->as.plastic.nonlinear);
    done();
    m = import(SCENE("<bsdf type=\"roughplastic\"><rgb name=\"diffuse_reflectance\" value=\"0.1 0.2 0.3\"/>"
                     "<float name=\"alpha\" value=\"0.25\"/><boolean name=\"nonlinear\" value=\"true\"/>"
                     "<float name=\"int_ior\" value=\"1.9\"/><string name=\"distribution\" value=\"ggx\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_ROUGH_PLASTIC);
    near((double)m->as.rough_plastic.layers.eta, 1.9 / 1.000277);
    is_rgb(m->as.rough_plastic.layers.diffuse, 0.1, 0.2, 0.3);
    is_grey(m->as.rough_plastic.facets.alpha_u, 0.25);
    assert_int_equal(m->as.rough_plastic.facets.alpha_v, m->as.rough_plastic.facets.alpha_u);
    assert_true(m->as.rough_plastic.layers.nonlinear);
    assert_int_equal(m->as.rough_plastic.facets.distribution, CA_MICROFACET_GGX);
    done();
}

/* Which counts as the least roughness. */
static void coats_may_be_smooth(void **state)
{
    (void)state;
    const ca_material *m = import(SCENE("<bsdf type=\"roughplastic\"><float name=\"alpha\" value=\"0\"/></bsdf>"));
    is_grey(m->as.rough_plastic.facets.alpha_u, 0.0);
    done();
    m = import(SCENE("<bsdf type=\"roughcoating\"><float name=\"alpha\" value=\"0\"/><bsdf type=\"diffuse\"/>"
                     "</bsdf>"));
    is_grey(m->as.coating.facets.alpha_u, 0.0);
    done();
}

static void principled(void **state)
{
    (void)state;
    const ca_material *m = import(SCENE("<bsdf type=\"principled\"/>"));
    assert_int_equal(m->kind, CA_MATERIAL_PRINCIPLED);
    is_grey(m->as.principled.base_color, 0.5);
    is_grey(m->as.principled.roughness, 0.5);
    is_grey(m->as.principled.anisotropic, 0.0);
    is_grey(m->as.principled.metallic, 0.0);
    is_grey(m->as.principled.clearcoat_gloss, 0.0);
    near((double)m->as.principled.eta, 1.5);
    near((double)m->as.principled.diffuse_rate, 1.0);
    done();
    m = import(SCENE("<bsdf type=\"principled\"><rgb name=\"base_color\" value=\"0.9 0.8 0.7\"/>"
                     "<float name=\"roughness\" value=\"0.11\"/><float name=\"anisotropic\" value=\"0.12\"/>"
                     "<float name=\"metallic\" value=\"0.13\"/><float name=\"spec_trans\" value=\"0.14\"/>"
                     "<float name=\"spec_tint\" value=\"0.15\"/><float name=\"sheen\" value=\"0.16\"/>"
                     "<float name=\"sheen_tint\" value=\"0.17\"/><float name=\"flatness\" value=\"0.18\"/>"
                     "<float name=\"clearcoat\" value=\"0.19\"/><float name=\"clearcoat_gloss\" value=\"0.2\"/>"
                     "<float name=\"eta\" value=\"1.7\"/>"
                     "<float name=\"diffuse_reflectance_sampling_rate\" value=\"2\"/>"
                     "<float name=\"main_specular_sampling_rate\" value=\"3\"/>"
                     "<float name=\"clearcoat_sampling_rate\" value=\"4\"/></bsdf>"));
    is_rgb(m->as.principled.base_color, 0.9, 0.8, 0.7);
    is_grey(m->as.principled.roughness, 0.11);
    is_grey(m->as.principled.anisotropic, 0.12);
    is_grey(m->as.principled.metallic, 0.13);
    is_grey(m->as.principled.spec_trans, 0.14);
    is_grey(m->as.principled.spec_tint, 0.15);
    is_grey(m->as.principled.sheen, 0.16);
    is_grey(m->as.principled.sheen_tint, 0.17);
    is_grey(m->as.principled.flatness, 0.18);
    is_grey(m->as.principled.clearcoat, 0.19);
    is_grey(m->as.principled.clearcoat_gloss, 0.2);
    near((double)m->as.principled.eta, 1.7);
    near((double)m->as.principled.diffuse_rate, 2.0);
    near((double)m->as.principled.specular_rate, 3.0);
    near((double)m->as.principled.clearcoat_rate, 4.0);
    done();
}

static void thin_principled(void **state)
{
    (void)state;
    const ca_material *m = import(SCENE("<bsdf type=\"principledthin\"/>"));
    assert_int_equal(m->kind, CA_MATERIAL_PRINCIPLED_THIN);
    is_grey(m->as.principled_thin.base_color, 0.5);
    is_grey(m->as.principled_thin.roughness, 0.5);
    is_grey(m->as.principled_thin.diff_trans, 0.0);
    near((double)m->as.principled_thin.eta, 1.5);
    done();
    m = import(SCENE("<bsdf type=\"principledthin\"><rgb name=\"base_color\" value=\"0.9 0.8 0.7\"/>"
                     "<float name=\"roughness\" value=\"0.11\"/><float name=\"anisotropic\" value=\"0.12\"/>"
                     "<float name=\"spec_trans\" value=\"0.14\"/><float name=\"spec_tint\" value=\"0.15\"/>"
                     "<float name=\"sheen\" value=\"0.16\"/><float name=\"sheen_tint\" value=\"0.17\"/>"
                     "<float name=\"flatness\" value=\"0.18\"/><float name=\"diff_trans\" value=\"1.4\"/>"
                     "<float name=\"eta\" value=\"1.7\"/>"
                     "<float name=\"diffuse_transmittance_sampling_rate\" value=\"2\"/></bsdf>"));
    is_rgb(m->as.principled_thin.base_color, 0.9, 0.8, 0.7);
    is_grey(m->as.principled_thin.roughness, 0.11);
    is_grey(m->as.principled_thin.anisotropic, 0.12);
    is_grey(m->as.principled_thin.spec_trans, 0.14);
    is_grey(m->as.principled_thin.spec_tint, 0.15);
    is_grey(m->as.principled_thin.sheen, 0.16);
    is_grey(m->as.principled_thin.sheen_tint, 0.17);
    is_grey(m->as.principled_thin.flatness, 0.18);
    is_grey(m->as.principled_thin.diff_trans, 1.4);
    near((double)m->as.principled_thin.eta, 1.7);
    done();
}

static void ward(void **state)
{
    (void)state;
    const ca_material *m = import(SCENE("<bsdf type=\"ward\"/>"));
    assert_int_equal(m->kind, CA_MATERIAL_WARD);
    assert_int_equal(m->as.ward.variant, CA_WARD_BALANCED);
    is_grey(m->as.ward.diffuse, 0.5);
    is_grey(m->as.ward.specular, 0.2);
    is_grey(m->as.ward.alpha_u, 0.1);
    assert_int_equal(m->as.ward.alpha_u, m->as.ward.alpha_v);
    done();
    m = import(SCENE("<bsdf type=\"ward\"><string name=\"variant\" value=\"ward-duer\"/>"
                     "<float name=\"alphaU\" value=\"0.2\"/><float name=\"alphaV\" value=\"0.3\"/></bsdf>"));
    assert_int_equal(m->as.ward.variant, CA_WARD_DUER);
    is_grey(m->as.ward.alpha_u, 0.2);
    is_grey(m->as.ward.alpha_v, 0.3);
    done();
    m = import(SCENE("<bsdf type=\"ward\"><string name=\"variant\" value=\"ward\"/></bsdf>"));
    assert_int_equal(m->as.ward.variant, CA_WARD_1992);
    done();
}

static void coatings(void **state)
{
    (void)state;
    const ca_material *m = import(SCENE("<bsdf type=\"coating\"><bsdf type=\"diffuse\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_COATING);
    near((double)m->as.coating.eta, 1.5046 / 1.000277);
    near((double)m->as.coating.thickness, 1.0);
    is_grey(m->as.coating.sigma_a, 0.0);
    is_grey(m->as.coating.specular, 1.0);
    assert_int_equal(m->as.coating.facets.alpha_u, CA_NONE);
    assert_int_equal(desc.materials.items[m->as.coating.child].material.kind, CA_MATERIAL_DIFFUSE);
    done();
    m = import(SCENE("<bsdf type=\"roughcoating\"><float name=\"intIOR\" value=\"1.7\"/>"
                     "<float name=\"extIOR\" value=\"1\"/><float name=\"thickness\" value=\"2\"/>"
                     "<rgb name=\"sigmaA\" value=\"3 2 1\"/><float name=\"alpha\" value=\"0.2\"/>"
                     "<float name=\"specularReflectance\" value=\"0.9\"/>"
                     "<string name=\"distribution\" value=\"ggx\"/><bsdf type=\"roughconductor\"/></bsdf>"));
    near((double)m->as.coating.eta, 1.7);
    near((double)m->as.coating.thickness, 2.0);
    is_rgb(m->as.coating.sigma_a, 3.0, 2.0, 1.0);
    is_grey(m->as.coating.specular, 0.9);
    is_grey(m->as.coating.facets.alpha_u, 0.2);
    assert_int_equal(m->as.coating.facets.distribution, CA_MICROFACET_GGX);
    done();
}

static void nested_bsdfs(void **state)
{
    (void)state;
    const ca_material *m =
        import(SCENE("<bsdf type=\"twosided\"><bsdf type=\"diffuse\"/><bsdf type=\"plastic\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_TWOSIDED);
    assert_int_equal(desc.materials.items[m->as.twosided.front].material.kind, CA_MATERIAL_DIFFUSE);
    assert_int_equal(desc.materials.items[m->as.twosided.back].material.kind, CA_MATERIAL_PLASTIC);
    done();
    m = import(SCENE("<bsdf type=\"mask\"><bsdf type=\"null\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_MASK);
    is_grey(m->as.mask.opacity, 0.5);
    assert_int_equal(desc.materials.items[m->as.mask.child].material.kind, CA_MATERIAL_NULL);
    done();
    m = import(SCENE("<bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"0.3\"/>"
                     "<bsdf name=\"a\" type=\"diffuse\"/><bsdf name=\"b\" type=\"conductor\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_BLEND);
    is_grey(m->as.blend.weight, 0.3);
    assert_int_equal(desc.materials.items[m->as.blend.first].material.kind, CA_MATERIAL_DIFFUSE);
    assert_int_equal(desc.materials.items[m->as.blend.second].material.kind, CA_MATERIAL_CONDUCTOR);
    done();
    /* A mixture is a chain of blends: 0.5 of the first, 0.3 of the second, 0.2 is absorbed. */
    m = import(SCENE("<bsdf type=\"mixturebsdf\"><string name=\"weights\" value=\"0.5, 0.3\"/>"
                     "<bsdf type=\"conductor\"/><bsdf type=\"plastic\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_BLEND);
    near((double)desc.textures.items[m->as.blend.weight].as.constant.r, 0.5);
    assert_int_equal(desc.materials.items[m->as.blend.first].material.kind, CA_MATERIAL_CONDUCTOR);
    const ca_material *rest = &desc.materials.items[m->as.blend.second].material;
    near((double)desc.textures.items[rest->as.blend.weight].as.constant.r, 0.4);
    assert_int_equal(desc.materials.items[rest->as.blend.first].material.kind, CA_MATERIAL_PLASTIC);
    const ca_material *black = &desc.materials.items[rest->as.blend.second].material;
    assert_int_equal(black->kind, CA_MATERIAL_DIFFUSE);
    near((double)desc.textures.items[black->as.diffuse.reflectance].as.constant.r, 0.0);
    done();
    m = import(SCENE("<bsdf type=\"phong\"><float name=\"exponent\" value=\"12\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_PHONG);
    near((double)desc.textures.items[m->as.phong.exponent].as.constant.r, 12.0);
    near((double)desc.textures.items[m->as.phong.diffuse].as.constant.r, 0.5);
    near((double)desc.textures.items[m->as.phong.specular].as.constant.r, 0.2);
    done();
    m = import(SCENE("<bsdf type=\"roughdiffuse\"><float name=\"alpha\" value=\"0.4\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_ROUGH_DIFFUSE);
    near((double)desc.textures.items[m->as.rough_diffuse.alpha].as.constant.r, 0.4);
    assert_int_equal(desc.notes.count, 1);
    done();
    m = import(SCENE("<bsdf type=\"roughconductorGGX\"><rgb name=\"eta\" value=\"-0.1 0.2 0.3\"/></bsdf>"));
    assert_int_equal(m->as.rough_conductor.facets.distribution, CA_MICROFACET_GGX);
    near((double)desc.textures.items[m->as.rough_conductor.eta].as.constant.r, -0.1);
    assert_int_equal(desc.notes.count, 0);
    done();
    m = import(SCENE("<bsdf type=\"roughconductor\"><string name=\"distribution\" value=\"phong\"/></bsdf>"));
    assert_int_equal(m->as.rough_conductor.facets.distribution, CA_MICROFACET_BECKMANN);
    assert_int_equal(desc.notes.count, 1);
    done();
    m = import(SCENE("<bsdf type=\"bumpmap\"><texture type=\"checkerboard\"/><float name=\"scale\" value=\"2\"/>"
                     "<bsdf type=\"diffuse\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_BUMP);
    near((double)m->as.bump.scale, 2.0);
    assert_true(m->as.bump.rules.flips && m->as.bump.rules.shadows);
    assert_int_equal(desc.textures.items[m->as.bump.height].kind, CA_TEXTURE_CHECKERBOARD);
    assert_int_equal(desc.materials.items[m->as.bump.child].material.kind, CA_MATERIAL_DIFFUSE);
    done();
    m = import(SCENE("<bsdf type=\"normalmap\"><texture name=\"normalmap\" type=\"checkerboard\"/>"
                     "<bsdf type=\"diffuse\"/></bsdf>"));
    assert_int_equal(m->kind, CA_MATERIAL_NORMAL_MAP);
    assert_int_equal(desc.textures.items[m->as.normal_map.normals].kind, CA_TEXTURE_CHECKERBOARD);
    done();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(dielectrics), cmocka_unit_test(conductors), cmocka_unit_test(conductor_table_is_sound),
        cmocka_unit_test(plastics),    cmocka_unit_test(principled), cmocka_unit_test(nested_bsdfs),
        cmocka_unit_test(coats_may_be_smooth),
        cmocka_unit_test(coatings), cmocka_unit_test(thin_principled), cmocka_unit_test(ward),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
