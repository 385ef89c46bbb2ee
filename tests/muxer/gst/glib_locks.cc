// SPDX-License-Identifier: BSD-3-Clause
// For the thread sanitizer only: GLib's locks are futexes inside a library that is not instrumented, so it
// cannot see what they order. Calls of GLib's locks and queues, from GStreamer and from us, come here first
// and tell it.
#include <dlfcn.h>
#include <gst/gst.h>
#include <sanitizer/tsan_interface.h>

namespace {

/// The function of that name in the libraries behind this program.
template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

/// Readers of a lock are ordered with its writers, and not with each other.
void* readersOf(GRWLock* lock) { return reinterpret_cast<char*>(lock) + 1; }

}  // namespace

#define NEXT(name) static const auto real = next<decltype(name)>(#name)

extern "C" {

void g_mutex_lock(GMutex* mutex) {
  NEXT(g_mutex_lock);
  real(mutex);
  __tsan_acquire(mutex);
}
gboolean g_mutex_trylock(GMutex* mutex) {
  NEXT(g_mutex_trylock);
  const gboolean locked = real(mutex);
  if (locked) __tsan_acquire(mutex);
  return locked;
}
void g_mutex_unlock(GMutex* mutex) {
  NEXT(g_mutex_unlock);
  __tsan_release(mutex);
  real(mutex);
}

void g_rec_mutex_lock(GRecMutex* mutex) {
  NEXT(g_rec_mutex_lock);
  real(mutex);
  __tsan_acquire(mutex);
}
gboolean g_rec_mutex_trylock(GRecMutex* mutex) {
  NEXT(g_rec_mutex_trylock);
  const gboolean locked = real(mutex);
  if (locked) __tsan_acquire(mutex);
  return locked;
}
void g_rec_mutex_unlock(GRecMutex* mutex) {
  NEXT(g_rec_mutex_unlock);
  __tsan_release(mutex);
  real(mutex);
}

void g_rw_lock_reader_lock(GRWLock* lock) {
  NEXT(g_rw_lock_reader_lock);
  real(lock);
  __tsan_acquire(lock);
}
void g_rw_lock_reader_unlock(GRWLock* lock) {
  NEXT(g_rw_lock_reader_unlock);
  __tsan_release(readersOf(lock));
  real(lock);
}
void g_rw_lock_writer_lock(GRWLock* lock) {
  NEXT(g_rw_lock_writer_lock);
  real(lock);
  __tsan_acquire(lock);
  __tsan_acquire(readersOf(lock));
}
void g_rw_lock_writer_unlock(GRWLock* lock) {
  NEXT(g_rw_lock_writer_unlock);
  __tsan_release(lock);
  real(lock);
}

void g_cond_wait(GCond* cond, GMutex* mutex) {
  NEXT(g_cond_wait);
  __tsan_release(mutex);
  real(cond, mutex);
  __tsan_acquire(mutex);
}
gboolean g_cond_wait_until(GCond* cond, GMutex* mutex, gint64 end) {
  NEXT(g_cond_wait_until);
  __tsan_release(mutex);
  const gboolean signalled = real(cond, mutex, end);
  __tsan_acquire(mutex);
  return signalled;
}

// What one thread puts into a queue another one takes out: that lock is inside GLib.
void g_async_queue_push(GAsyncQueue* queue, gpointer data) {
  NEXT(g_async_queue_push);
  __tsan_release(queue);
  real(queue, data);
}
gpointer g_async_queue_try_pop(GAsyncQueue* queue) {
  NEXT(g_async_queue_try_pop);
  const gpointer data = real(queue);
  __tsan_acquire(queue);
  return data;
}
gpointer g_async_queue_timeout_pop(GAsyncQueue* queue, guint64 microseconds) {
  NEXT(g_async_queue_timeout_pop);
  const gpointer data = real(queue, microseconds);
  __tsan_acquire(queue);
  return data;
}

// Whoever drops the last reference sees all that others did before they dropped theirs.
void g_object_unref(gpointer object) {
  NEXT(g_object_unref);
  __tsan_release(object);
  __tsan_acquire(object);
  real(object);
}
void gst_mini_object_unref(GstMiniObject* object) {
  NEXT(gst_mini_object_unref);
  __tsan_release(object);
  __tsan_acquire(object);
  real(object);
}

}  // extern "C"
