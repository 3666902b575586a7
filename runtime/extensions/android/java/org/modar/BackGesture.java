package org.modar;

import android.app.Activity;
import java.lang.reflect.InvocationHandler;
import java.lang.reflect.Method;
import java.lang.reflect.Proxy;

/**
 * The back gesture of apps that target Android 16: the system calls a registered callback and no longer
 * Activity.onBackPressed(). Its classes (API 33) are called by reflection, since the app is compiled against older ones.
 */
final class BackGesture implements InvocationHandler {
    private final Activity activity;

    private BackGesture(Activity activity) {
        this.activity = activity;
    }

    /** Sends the gesture to activity.onBackPressed(). Does nothing where the classes are missing: the system calls it then. */
    static void sendTo(Activity activity) {
        try {
            Class<?> callback = Class.forName("android.window.OnBackInvokedCallback");
            Class<?> dispatcher = Class.forName("android.window.OnBackInvokedDispatcher");
            Object proxy = Proxy.newProxyInstance(
                    callback.getClassLoader(), new Class<?>[] {callback}, new BackGesture(activity));
            Object registry = Activity.class.getMethod("getOnBackInvokedDispatcher").invoke(activity);
            dispatcher.getMethod("registerOnBackInvokedCallback", int.class, callback).invoke(registry, 0, proxy);
        } catch (ReflectiveOperationException e) {
            // Android before 13.
        }
    }

    @Override
    public Object invoke(Object proxy, Method method, Object[] arguments) {
        String name = method.getName();
        if (name.equals("onBackInvoked")) activity.onBackPressed();
        if (name.equals("equals")) return proxy == arguments[0];
        if (name.equals("hashCode")) return System.identityHashCode(proxy);
        return name.equals("toString") ? getClass().getName() : null;
    }
}
