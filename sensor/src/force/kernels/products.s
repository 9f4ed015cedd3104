@ Products of one vector of i16 with four others: see `products` in cortex_m7.rs.
@
@ r0 the one   r1 the first of the four   r2 end of the one   r4-r11 four sums of 64 bits
@ r12 two numbers of the one   r3, lr two of the others
@ stack: where sums go
@
@ Schedule: every SMLALD goes with the load for the next one.

    .syntax unified
    .section .text.hivtac_products, "ax", %progbits
    .balign 8
    .global hivtac_products
    .type hivtac_products, %function
    .thumb_func

@ Two numbers of each, 8 products, at the offset \x.
.macro hivtac_products_of_two x
    ldr.w   r12, [r0, #\x]
    ldr.w   lr, [r1, #\x]
    ldr.w   r3, [r1, #\x + 392]
    smlald  r4, r5, r12, lr
    ldr.w   lr, [r1, #\x + 784]
    smlald  r6, r7, r12, r3
    ldr.w   r3, [r1, #\x + 1176]
    smlald  r8, r9, r12, lr
    smlald  r10, r11, r12, r3
.endm

hivtac_products:
    push    {r3-r11, lr}
    movs    r4, #0
    movs    r5, #0
    movs    r6, #0
    movs    r7, #0
    mov     r8, r4
    mov     r9, r4
    mov     r10, r4
    mov     r11, r4
    .balign 8
.Lhivtac_products_block:
    hivtac_products_of_two 0
    hivtac_products_of_two 4
    hivtac_products_of_two 8
    hivtac_products_of_two 12
    add.w   r0, r0, #16
    add.w   r1, r1, #16
    cmp     r0, r2
    bne.w   .Lhivtac_products_block
    pop     {r3}
    stm     r3, {r4-r11}
    pop     {r4-r11, pc}
    .size hivtac_products, . - hivtac_products
