#include "support/live_fixture.h"

#include "base/clock.h"
#include "image/layers.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

ca_live_fake fake;

void assert_says(const char *text, const char *words)
{
    if (!strstr(text, words)) fail_msg("\"%s\" is not said in: %s", words, text);
}

bool ca_live_fake_interrupted(void) { return __atomic_load_n(&fake.interrupted, __ATOMIC_RELAXED); }

ca_image_layers *ca_live_fake_picture(uint32_t passes)
{
    ca_image_layers *image;
    float *planes[4];
    static const char *const names[4] = {"A", "B", "G", "R"};
    assert_int_equal(ca_layers_create(&image, fake.width, fake.height, NULL), CA_OK);
    for (int c = 0; c < 4; c++) assert_int_equal(ca_layers_add(image, names[c], &planes[c], NULL), CA_OK);
    for (size_t i = 0; i < (size_t)fake.width * fake.height; i++) {
        planes[0][i] = -1.0f;
        planes[1][i] = (float)(i / fake.width);
        planes[2][i] = (float)(i % fake.width);
        planes[3][i] = (float)passes;
    }
    return image;
}

static void work(double seconds)
{
    for (const double end = ca_clock_thread_seconds() + seconds; ca_clock_thread_seconds() < end;) continue;
}

static ca_status snapshot(const ca_render_progress *progress, ca_image_layers **image,
                          ca_render_statistics *statistics, ca_error *error)
{
    (void)error;
    work(fake.picture_seconds);
    fake.pictures++;
    *image = ca_live_fake_picture(progress->passes_done);
    *statistics = (ca_render_statistics){.samples_per_pixel = progress->passes_done, .noise_percent = 5.0};
    return CA_OK;
}

ca_status ca_live_fake_save(const ca_image_layers *image, const ca_render_statistics *statistics, void *user,
                            char *message, size_t size, ca_error *error)
{
    (void)error;
    ca_live_fake *f = user;
    f->saves++;
    f->saved = ca_layers_find(image, "R")[0];
    snprintf(message, size, "saved \"a.exr\" with %g samples", statistics->samples_per_pixel);
    return CA_OK;
}

void ca_live_fake_open(bool serves, const char *tev)
{
    ca_error error = {""};
    fake = (ca_live_fake){.width = CA_LIVE_WIDTH, .height = CA_LIVE_HEIGHT, .pass_seconds = 0.005};
    const ca_live_settings settings = {.serves = serves,
                                       .tev = tev,
                                       .title = CA_LIVE_TITLE,
                                       .threads = 1,
                                       .save = ca_live_fake_save,
                                       .is_interrupted = ca_live_fake_interrupted,
                                       .user = &fake};
    if (ca_live_create(&fake.live, &settings, &error) != CA_OK) fail_msg("%s", error.message);
    if (serves) assert_true(ca_live_find_place(&fake.place, ca_live_url(fake.live)));
}

void ca_live_fake_close(void)
{
    ca_live_destroy(fake.live);
    fake.live = NULL;
}

bool ca_live_fake_pass(void)
{
    const ca_render_progress progress = {.passes_done = ++fake.passes,
                                         .passes_total = 100000,
                                         .seconds = 0.01 * fake.passes,
                                         .noise_percent = -1.0,
                                         .snapshot = snapshot};
    work(fake.pass_seconds); /* so that there is processor time to spend a share of */
    return ca_live_report(fake.live, &progress);
}

int ca_live_fake_fetch(const char *method, const char *resource, char *text, size_t size)
{
    char path[256];
    snprintf(path, sizeof path, "%s%s", fake.place.path, resource);
    return ca_live_fetch(fake.place.port, method, path, fake.place.host, text, size);
}

void *ca_live_client_run(void *user)
{
    ca_live_client *c = user;
    c->act(c->seen, c->size);
    __atomic_store_n(&c->ready, true, __ATOMIC_RELEASE);
    return NULL;
}

bool ca_live_fake_beside(void (*act)(char *seen, size_t size), char *seen, size_t size)
{
    ca_live_client client = {.act = act, .seen = seen, .size = size};
    pthread_t thread;
    bool goes_on = true;
    seen[0] = '\0';
    assert_int_equal(pthread_create(&thread, NULL, ca_live_client_run, &client), 0);
    while (goes_on && !__atomic_load_n(&client.ready, __ATOMIC_ACQUIRE)) goes_on = ca_live_fake_pass();
    pthread_join(thread, NULL);
    return goes_on;
}
