// The handler of faults. Reads what the core stacked, where the stack is in its memory, and goes on
// in failure.rs with the stack afresh: the program's may be used up, and nothing returns to it.

    .syntax unified
    .section .text.HardFault, "ax", %progbits
    .global HardFault
    .type HardFault, %function
    .thumb_func
HardFault:
    cpsid   i
    mrs     r3, msp
    movs    r0, #0
    movs    r1, #0
    movs    r2, #0
    ldr     r4, =_stack_end         // its lowest address
    ldr     r5, =_stack_start
    cmp     r3, r4
    blo     1f
    sub     r4, r5, #32
    cmp     r3, r4
    bhi     1f
    ldr     r0, [r3, #24]           // program counter
    ldr     r1, [r3, #20]           // link register
    ldr     r2, [r3, #28]           // program status
1:  msr     msp, r5
    b       hard_fault
    .ltorg
    .size HardFault, . - HardFault
