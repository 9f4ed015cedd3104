#!/bin/busybox sh
# What Linux does with the sensor: it attaches the rig's device by USB/IP, reads forces, and goes on
# reading after everything that it can do to a port. /parameters sets PORT, FORCES and TIMES.
/bin/busybox --install -s /bin
export PATH=/bin
mount -t proc none /proc
mount -t sysfs none /sys
mount -t devtmpfs none /dev
mkdir -p /var/run /tmp
. /parameters
for module in $MODULES; do insmod "/modules/$module.ko" || echo "module $module ... FAIL"; done
ip link set lo up
ip addr add 10.0.2.15/24 dev eth0
ip link set eth0 up
# The judged part begins here.
dmesg -c > /dev/null

DEVICE=/sys/bus/usb/devices/1-1

# Waits up to 60 s for a command to succeed.
until_so() {
    for _ in $(seq 600); do
        "$@" > /dev/null 2>&1 && return 0
        sleep 0.1
    done
    return 1
}

is_suspended() { grep -q suspended "$DEVICE/power/runtime_status"; }
has_lines() { [ "$(grep -c . /tmp/amid)" -ge 5 ]; }

# The port has another number than before if a program still held it.
has_port() {
    TTY=/dev/$(ls "$DEVICE:1.0/tty")
    test -c "$TTY"
}

# Forces come: so many of them, without an error.
forces() {
    until_so has_port || { echo "no port"; return 1; }
    timeout 900 hivtac monitor --port "$TTY" --timeout 60 --frames "$1" > /tmp/forces 2>&1 ||
        { tail -n 5 /tmp/forces; return 1; }
}

attach() {
    usbip --tcp-port "$PORT" attach -r 10.0.2.2 -b 1-1 > /tmp/usbip 2>&1 ||
        { cat /tmp/usbip; return 1; }
}

enumerates() {
    attach && until_so grep -q "HiVTac" "$DEVICE/product" && forces "$FORCES" &&
        grep "received" /tmp/forces
}

listed() { usbip --tcp-port "$PORT" list -r 10.0.2.2 2>&1 | grep -q "1-1: .*1209:0001"; }

# Does something while forces come, after which the tool ends as one that lost its connection.
amid() {
    : > /tmp/amid
    timeout 120 hivtac monitor --port "$TTY" --timeout 60 > /tmp/amid 2>&1 &
    until_so has_lines || { cat /tmp/amid; return 1; }
    "$@" > /tmp/done 2>&1 || { cat /tmp/done; return 1; }
    wait $!
    [ $? = 5 ] || { tail -n 3 /tmp/amid; return 1; }
}

# Does something, every second time while forces come.
at_times() {
    time=$1
    shift
    case $((time % 2)) in
        0) amid "$@" ;;
        *) "$@" > /tmp/done 2>&1 || { cat /tmp/done; return 1; } ;;
    esac
}

set_configuration() { echo 1 > "$DEVICE/bConfigurationValue"; }

reset() { at_times "$1" usbreset 1209:0001 && forces 5; }

configured() { at_times "$1" set_configuration && forces 5; }

suspended() {
    echo 100 > "$DEVICE/power/autosuspend_delay_ms"
    echo auto > "$DEVICE/power/control"
    until_so is_suspended || { echo "not suspended"; return 1; }
    # Three seconds without a transfer: the rig has suspended its bus, too.
    sleep 3
    echo on > "$DEVICE/power/control"
    grep -q active "$DEVICE/power/runtime_status" && forces 5
}

pulled() { amid usbip detach -p 0 && until_so test ! -e "$DEVICE" && attach && forces 5; }

check() {
    what=$1
    shift
    if "$@"; then echo "$what ... ok"; else echo "$what ... FAIL"; fi
}

check "listed by usbip" listed
check "enumerated, $FORCES forces" enumerates
for action in reset configured suspended pulled; do
    for n in $(seq "$TIMES"); do check "$action, time $n of $TIMES" "$action" "$n"; done
done
# Each warning of the kernel, but for those that it prints whatever the device does: the driver of
# USB/IP has no name for full speed when it resets a port, and the emulated PC stands still while
# its process waits for a processor.
dmesg -r | awk -F '[<>]' '/^<[0-9]+>/ && $2 % 8 <= 4' |
    grep -v -e "vhci_hcd: vhci_device speed not set" -e "clocksource: " | sed 's/$/ ... FAIL/'
echo "Linux has ended"
poweroff -f
