//! Messages of the validation layers, collected so that tests and `--validate` can fail on them.

use std::ffi::{CStr, c_char, c_void};
use std::sync::{Arc, Mutex};

use ash::vk;

/// The messages that the validation layers have reported so far. Clones share one list.
#[derive(Debug, Clone, Default)]
pub struct Messages(Arc<Mutex<Vec<String>>>);

impl Messages {
    /// A copy of all messages so far.
    pub fn all(&self) -> Vec<String> {
        self.lock().clone()
    }

    /// Removes and returns all messages.
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.lock())
    }

    /// Puts messages back that were taken.
    pub(crate) fn put_back(&self, messages: Vec<String>) {
        self.lock().splice(0..0, messages);
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<String>> {
        // A panic while the list was held leaves it usable: a push is all that happens under the lock.
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// What the messenger calls; `self` must outlive the messenger at an unchanged address.
    pub(crate) fn create_info(
        self: &Arc<Self>,
        severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    ) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
        vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(severity)
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(on_message))
            .user_data(Arc::as_ptr(self).cast_mut().cast())
    }
}

unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: `user` is the `Messages` that `Instance` keeps alive longer than its messenger, and the
    // loader passes valid callback data whose strings live for this call.
    unsafe {
        let messages = &*user.cast::<Messages>();
        let string = |text: *const c_char| {
            if text.is_null() { String::new() } else { CStr::from_ptr(text).to_string_lossy().into_owned() }
        };
        let (name, text) = match data.as_ref() {
            Some(data) => (string(data.p_message_id_name), string(data.p_message)),
            None => Default::default(),
        };
        // Newer layers do not repeat the rule's name in the text.
        let text = if text.contains(&name) { text } else { format!("{name}: {text}") };
        log::error!("validation: {text}");
        messages.lock().push(text);
    }
    vk::FALSE
}
